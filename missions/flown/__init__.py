"""A finished flight: its records, score, verdict, pictures and run folder."""
