"""Journal bearings from their geometry: the oil film, its coefficients and its loads."""
