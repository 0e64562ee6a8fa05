"""What is measured held against what is predicted, while the machine runs."""
