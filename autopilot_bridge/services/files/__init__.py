"""MAVLink FTP and logs: the files on the vehicle's memory card."""
