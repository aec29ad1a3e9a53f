"""What a viewer calls the entries of a scene."""

from estimators.scene_items import Field, Gaussian, Value

__all__ = ["field_label", "gaussian_label", "series_name"]


def series_name(path: str, item: Value) -> str:
    """Such as "vehicle 1 height, m"."""
    parts = path.replace("_", " ").split("/")
    words = " ".join(parts[1:]) if parts[0] in ("estimators", "vehicles") else " ".join(parts)
    words = f"vehicle {words}" if parts[0] == "vehicles" else words
    return f"{words}, {item.unit}" if item.unit else words


def gaussian_label(item: Gaussian) -> str:
    """Its label, and how wide it is: "target, 3 sigma: 12 x 5 m"."""
    longer_m, shorter_m = item.half_axes_m
    size = f"3 sigma: {longer_m:.3g} x {shorter_m:.3g} m"
    return f"{item.label}, {size}" if item.label else size


def field_label(path: str, item: Field) -> str:
    """Name, unit and the ends of its colour scale: "grid: probability 0 (dark) to 0.02 (bright)"."""
    low, high = item.scale
    name = path.split("/", 1)[-1].replace("_", " ").replace("/", " ")
    return f"{name}: {low:.3g} (dark) to {high:.3g} (bright) {item.unit}".rstrip()
