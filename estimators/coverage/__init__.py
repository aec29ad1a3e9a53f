"""What a flight has searched: swept area, coverage and probability of detection on a grid.

Terms as in the IAMSAR Manual, volume II (2019), chapter 4, and Koopman, "Search and Screening" (1946): the
*sweep width* of a sensor is the integral of its lateral range curve; *search effort* is sweep width times
length of the track; *coverage* is effort by area; *POD* is the probability that a target that is there has
been detected by all searches together.
"""
