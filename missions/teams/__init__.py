"""What a team of vehicles shares: layers of height, and steering along headings."""
