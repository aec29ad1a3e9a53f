"""Statistics of trials: figures with intervals, success rates, and differences in pairs of equal seeds."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from flightsim.foundation.random_streams import RandomStreams

__all__ = [
    "Difference",
    "Figures",
    "Rate",
    "figures_of",
    "paired_difference",
    "paired_rates",
    "rate_of",
    "share_interval",
    "unpaired_difference",
    "unpaired_rates",
]

Array = NDArray[np.float64]
Interval = tuple[float, float]

LEVEL: Final = 0.95
RESAMPLES: Final = 2000
FEW: Final = 10
"""Below so many values the bootstrap's intervals are too narrow, and Student's and order statistics are
used.
"""
_MANY: Final = 5000
"""From so many values on, intervals are Student's and of order statistics: the bootstrap gives the same
there.
"""
_POWER: Final = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """Figures of one quantity in one cell.

    Attributes:
        n: number of values.
        mean, median, sd: of the values; sd with n - 1.
        q05, q95: quantiles.
        mean_ci95, median_ci95: 95 % intervals, bootstrap (BCa).
    """

    n: int
    mean: float
    median: float
    sd: float
    q05: float
    q95: float
    mean_ci95: Interval
    median_ci95: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """A share of trials.

    Attributes:
        n, count: number of trials, and of those among them that are counted.
        rate: share; NaN without trials.
        ci95: its Wilson interval.
    """

    n: int
    count: int
    rate: float
    ci95: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """The difference of two cells in pairs of equal seeds.

    Attributes:
        n: number of pairs.
        mean: mean difference.
        ci95: its 95 % interval.
        runs_needed: number of pairs at which a difference of this size would exclude 0 in 80 % of studies;
            None: the interval excludes 0 already, or all differences are 0.
    """

    n: int
    mean: float
    ci95: Interval
    runs_needed: int | None

    @property
    def conclusive(self) -> bool:
        """Whether the interval excludes 0."""
        low, high = self.ci95
        return low > 0.0 or high < 0.0


def figures_of(values: Array) -> Figures:
    """Figures of values; those that are not finite are left out."""
    known = values[np.isfinite(values)]
    n = len(known)
    if not n:
        none = (math.nan, math.nan)
        return Figures(
            n=0, mean=math.nan, median=math.nan, sd=math.nan, q05=math.nan, q95=math.nan,
            mean_ci95=none, median_ci95=none,
        )  # fmt: skip
    low, high = np.quantile(known, (0.05, 0.95))
    return Figures(
        n=n,
        mean=float(known.mean()),
        median=float(np.median(known)),
        sd=float(known.std(ddof=1)) if n > 1 else math.nan,
        q05=float(low),
        q95=float(high),
        mean_ci95=mean_interval(known),
        median_ci95=median_interval(known),
    )


def mean_interval(values: Array) -> Interval:
    """95 % interval of the mean: bootstrap (BCa); of few or very many values Student's."""
    n = len(values)
    if n < 2:
        return math.nan, math.nan
    if FEW <= n < _MANY:
        return _bootstrap(values, np.mean)
    half = float(stats.t.ppf(0.5 + 0.5 * LEVEL, n - 1)) * float(values.std(ddof=1)) / math.sqrt(n)
    return float(values.mean()) - half, float(values.mean()) + half


def median_interval(values: Array) -> Interval:
    """95 % interval of the median: bootstrap (BCa); of few or very many values that of the order statistics,
    NaN if there are too few for it (below 6).
    """
    n = len(values)
    if FEW <= n < _MANY:
        return _bootstrap(values, np.median)
    below = int(stats.binom.ppf(0.5 - 0.5 * LEVEL, n, 0.5))
    # the interval between the k-th value and the k-th from the end covers 1 - 2 P(B < k)
    if below < 1:
        return math.nan, math.nan
    ordered = np.sort(values)
    return float(ordered[below - 1]), float(ordered[n - below])


def _bootstrap(values: Array, statistic: Callable[..., object]) -> Interval:
    if np.ptp(values) == 0.0:
        return float(values[0]), float(values[0])
    for method in ("BCa", "percentile"):  # BCa has no interval if a resampled median hardly varies
        generator = RandomStreams(0).generator("study", "bootstrap")
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", stats.DegenerateDataWarning)
            found = stats.bootstrap(
                (values,),
                statistic,
                n_resamples=RESAMPLES,
                confidence_level=LEVEL,
                method=method,
                rng=generator,
            ).confidence_interval
        if math.isfinite(found.low) and math.isfinite(found.high):
            break
    return float(found.low), float(found.high)


def rate_of(count: int, n: int) -> Rate:
    """A share with its Wilson interval (Wilson 1927, without continuity correction)."""
    if not n:
        return Rate(n=0, count=0, rate=math.nan, ci95=(0.0, 1.0))
    interval = stats.binomtest(count, n).proportion_ci(LEVEL, method="wilson")
    return Rate(n=n, count=count, rate=count / n, ci95=(float(interval.low), float(interval.high)))


def share_interval(
    counted: NDArray[np.bool_], clusters: NDArray[np.generic] | None = None
) -> tuple[float, Interval]:
    """A share of trials with its 95 % interval.

    Args:
        counted: (n,) whether a trial counts.
        clusters: (n,) what trials share, such as their terrain: trials of one cluster are not independent, so
            the interval is that of a bootstrap over clusters (percentile), and of fewer than 10 clusters
            Student's of the shares of the clusters. None, or clusters of one trial each: Wilson's.

    Returns:
        the share, NaN without trials, and the interval.
    """
    n = len(counted)
    rate = rate_of(int(counted.sum()), n)
    if clusters is None:
        return rate.rate, rate.ci95
    which = np.unique(clusters, return_inverse=True)[1].reshape(-1)
    sizes = np.bincount(which).astype(np.float64)
    if len(sizes) == n:
        return rate.rate, rate.ci95
    if rate.count in (0, n):  # equal values show no spread: at worst a cluster is one independent trial
        return rate.rate, rate_of(len(sizes) if rate.count else 0, len(sizes)).ci95
    counts = np.bincount(which, weights=counted)
    if len(sizes) < FEW:
        low, high = mean_interval(counts / sizes)
    else:
        generator = RandomStreams(0).generator("study", "clusters")
        drawn = generator.integers(0, len(sizes), (RESAMPLES, len(sizes)))
        shares = counts[drawn].sum(axis=1) / sizes[drawn].sum(axis=1)
        low, high = np.quantile(shares, (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL)).tolist()
    return rate.rate, (max(0.0, low), min(1.0, high))


def paired_difference(values: Array, baseline: Array) -> Difference:
    """The mean of `values - baseline` in pairs, with its bootstrap interval.

    Args:
        values, baseline: (runs,), of equal seeds in equal places. Pairs with a value that is not finite are
            left out.
    """
    differences = values - baseline
    differences = differences[np.isfinite(differences)]
    n = len(differences)
    if not n:
        return Difference(n=0, mean=math.nan, ci95=(math.nan, math.nan), runs_needed=None)
    mean, interval = float(differences.mean()), mean_interval(differences)
    found = Difference(n=n, mean=mean, ci95=interval, runs_needed=None)
    if found.conclusive or n < 2:
        return found
    return Difference(
        n=n, mean=mean, ci95=interval, runs_needed=_runs_for(mean, float(differences.std(ddof=1)), n)
    )


def paired_rates(count: NDArray[np.bool_], baseline: NDArray[np.bool_]) -> Difference:
    """The difference of two rates in pairs: Wald's interval after half a pair is added to each kind of pair
    (Agresti and Min 2005).

    Args:
        count, baseline: (runs,), of equal seeds in equal places.
    """
    n = len(count)
    if not n:
        return Difference(n=0, mean=math.nan, ci95=(math.nan, math.nan), runs_needed=None)
    only, only_baseline = int(np.sum(count & ~baseline)), int(np.sum(~count & baseline))
    more, less, all_pairs = only + 0.5, only_baseline + 0.5, n + 2.0
    centre = (more - less) / all_pairs
    spread = math.sqrt(max(0.0, (more + less) - (more - less) ** 2 / all_pairs)) / all_pairs
    half = float(stats.norm.ppf(0.5 + 0.5 * LEVEL)) * spread
    mean = (only - only_baseline) / n
    found = Difference(
        n=n, mean=mean, ci95=(max(-1.0, centre - half), min(1.0, centre + half)), runs_needed=None
    )
    if found.conclusive:
        return found
    deviation = math.sqrt(max(0.0, (only + only_baseline) / n - mean**2))
    return Difference(n=n, mean=mean, ci95=found.ci95, runs_needed=_runs_for(mean, deviation, n))


def unpaired_difference(values: Array, baseline: Array) -> Difference:
    """The difference of the means of independent values, with Welch's interval."""
    one, other = values[np.isfinite(values)], baseline[np.isfinite(baseline)]
    n = min(len(one), len(other))
    if n < 2:
        return Difference(n=n, mean=math.nan, ci95=(math.nan, math.nan), runs_needed=None)
    mean = float(one.mean() - other.mean())
    interval = stats.ttest_ind(one, other, equal_var=False).confidence_interval(LEVEL)
    return Difference(n=n, mean=mean, ci95=(float(interval.low), float(interval.high)), runs_needed=None)


def unpaired_rates(count: NDArray[np.bool_], baseline: NDArray[np.bool_]) -> Difference:
    """The difference of two rates of independent trials, with the interval of Newcombe (1998, method 10),
    which combines the Wilson intervals of both.
    """
    n = min(len(count), len(baseline))
    if not n:
        return Difference(n=0, mean=math.nan, ci95=(math.nan, math.nan), runs_needed=None)
    one, other = (rate_of(int(c.sum()), len(c)) for c in (count, baseline))
    mean = one.rate - other.rate
    low = mean - math.hypot(one.rate - one.ci95[0], other.ci95[1] - other.rate)
    high = mean + math.hypot(one.ci95[1] - one.rate, other.rate - other.ci95[0])
    return Difference(n=n, mean=mean, ci95=(low, high), runs_needed=None)


def _runs_for(mean: float, deviation: float, n: int) -> int | None:
    """Pairs that show a difference of this mean and standard deviation with a power of 80 %: the normal
    formula and two more for Student's quantile, and more than the `n` that did not show it.
    """
    if mean == 0.0 or not math.isfinite(mean):
        return None
    quantiles = float(stats.norm.ppf(0.5 + 0.5 * LEVEL)) + float(stats.norm.ppf(_POWER))
    return max(n + 1, 2 + math.ceil((quantiles * deviation / mean) ** 2))
