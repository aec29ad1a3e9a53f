"""Search by steps from place to place: what the searching missions share."""
