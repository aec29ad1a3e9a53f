"""What a careful person looks at before a flight: findings from a vehicle's messages and parameters."""
