"""Estimators beside flights: tapped into one, in a process of their own, over logs; reports and pictures."""
