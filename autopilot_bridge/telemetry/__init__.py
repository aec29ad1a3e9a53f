"""What the autopilot says of itself: message builders per flavour and the streams that send them."""
