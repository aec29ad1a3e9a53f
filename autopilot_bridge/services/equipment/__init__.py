"""The vehicle's equipment: actuators, and commands for camera and gimbal."""
