"""The mission `survey`: an aircraft measures the magnetic field along lines (Lum et al. 2005, section II)."""
