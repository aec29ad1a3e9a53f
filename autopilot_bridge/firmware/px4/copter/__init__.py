"""PX4 on a multicopter."""
