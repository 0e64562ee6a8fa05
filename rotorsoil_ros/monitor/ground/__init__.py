"""What of a measured vibration comes from ground that moves by itself."""
