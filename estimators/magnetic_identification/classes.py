"""The classes of anomalies that are distinguished: the targets sought, known false anomalies, and dipoles of
any kind.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

__all__ = ["AnomalyClass", "DipoleClass", "GaussianClass", "classes_from"]

_FORMS: Final = (
    "NAME:gaussian:AMPLITUDE:ALONG:ACROSS (nT, m, m) or NAME:dipole:STRENGTH:LEAST:MOST (nT, m, m)"
)
_WEAKEST_NT: Final = 1e-3
_STRONGEST_NT: Final = 1e6
_LEAST_M: Final = 1.0
_MOST_M: Final = 1e5


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianClass:
    """Anomalies with a two-dimensional Gaussian signature (Lum et al. 2005, figure 3).

    Attributes:
        name: name for users.
        sought: whether it is a target.
        amplitude_nt: expected amplitude; below zero for a hole; its size is 0.001..1e6 nT.
        sigma_along_m, sigma_across_m: standard deviations along and across its axis, 1..1e5 m.
        amplitude_spread, size_spread: relative standard deviations of amplitude and extent within the class.
    """

    name: str
    sought: bool = True
    amplitude_nt: float = 30.0
    sigma_along_m: float = 80.0
    sigma_across_m: float = 60.0
    amplitude_spread: float = 0.15
    size_spread: float = 0.1

    def __post_init__(self) -> None:
        _check_name(self.name)
        if not _WEAKEST_NT <= abs(self.amplitude_nt) <= _STRONGEST_NT:
            raise ValueError(
                f"amplitude_nt {self.amplitude_nt:g} of class {self.name} is not accepted; sizes of "
                f"{_WEAKEST_NT:g} to {_STRONGEST_NT:g} nT are"
            )
        for field in ("sigma_along_m", "sigma_across_m"):
            _check_extent(self.name, field, getattr(self, field))
        for field in ("amplitude_spread", "size_spread"):
            value = getattr(self, field)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"{field} {value:g} of class {self.name} is not in 0..1, without 1")

    @property
    def reach_m(self) -> float:
        """Distance beyond which the signature is below a hundredth of its amplitude."""
        return 3.0 * max(self.sigma_along_m, self.sigma_across_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class DipoleClass:
    """Compact bodies, such as boats and wrecks: dipoles of any direction.

    Attributes:
        name: name for users.
        sought: whether it is a target.
        strength_nt: standard deviation of the strength mu_0 m / (4 pi d^3) per axis, where d is the depth of
            the body below the sensor; 0.001..1e6 nT. Right above the body, a dipole along a vertical field
            makes twice as much.
        least_m, most_m: smallest and largest depth of the body below the sensor, 1..1e5 m.
    """

    name: str
    sought: bool = False
    strength_nt: float = 15.0
    least_m: float = 30.0
    most_m: float = 300.0

    def __post_init__(self) -> None:
        _check_name(self.name)
        if not _WEAKEST_NT <= self.strength_nt <= _STRONGEST_NT:
            raise ValueError(
                f"strength_nt {self.strength_nt:g} of class {self.name} is not accepted; "
                f"{_WEAKEST_NT:g} to {_STRONGEST_NT:g} nT is"
            )
        for field in ("least_m", "most_m"):
            _check_extent(self.name, field, getattr(self, field))
        if not self.least_m < self.most_m:
            raise ValueError(
                f"most_m {self.most_m:g} of class {self.name} is not more than least_m {self.least_m:g}"
            )

    @property
    def reach_m(self) -> float:
        """Horizontal distance within which the strongest anomalies of the class, the shallow ones, are."""
        return 2.0 * self.least_m


AnomalyClass: TypeAlias = GaussianClass | DipoleClass


def classes_from(texts: Sequence[str], *, sought: bool) -> tuple[AnomalyClass, ...]:
    """Classes from texts such as `submarine:gaussian:30:80:60`.

    Raises:
        ValueError: a text is no class; the message has the accepted forms.
    """
    return tuple(_class_from(text, sought) for text in texts)


def _class_from(text: str, sought: bool) -> AnomalyClass:
    parts = text.split(":")
    try:
        name, form, numbers = parts[0], parts[1], [float(part) for part in parts[2:]]
        if form == "gaussian":
            amplitude_nt, along_m, across_m = numbers
            return GaussianClass(
                name=name,
                sought=sought,
                amplitude_nt=amplitude_nt,
                sigma_along_m=along_m,
                sigma_across_m=across_m,
            )
        if form == "dipole":
            strength_nt, least_m, most_m = numbers
            return DipoleClass(
                name=name, sought=sought, strength_nt=strength_nt, least_m=least_m, most_m=most_m
            )
    except (IndexError, ValueError) as error:
        why = f": {error}" if "of class" in str(error) else ""
        raise ValueError(f"class {text!r} is not accepted{why}; give {_FORMS}") from None
    raise ValueError(f"class {text!r} is not accepted; give {_FORMS}")


def _check_name(name: str) -> None:
    if not name.replace("-", "").replace("_", "").isalnum():
        raise ValueError(f"class name {name!r} is not accepted; give letters, digits, '-' and '_'")


def _check_extent(name: str, field: str, value_m: float) -> None:
    if not _LEAST_M <= value_m <= _MOST_M:
        raise ValueError(
            f"{field} {value_m:g} of class {name} is not accepted; {_LEAST_M:g} to {_MOST_M:g} m is"
        )
