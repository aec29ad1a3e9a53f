"""The units of JSBSim's properties in SI units (exact: foot, pound and pound-force of 1959)."""

from typing import Final

M_PER_FT: Final = 0.3048
N_PER_LBF: Final = 4.4482216152605
NM_PER_LBF_FT: Final = 1.3558179483314004
KG_PER_SLUG: Final = 14.593902937206364
KG_M2_PER_SLUG_FT2: Final = 1.3558179483314004
KG_M3_PER_SLUG_FT3: Final = 515.3788183931961
PA_PER_PSF: Final = 47.88025898033584
