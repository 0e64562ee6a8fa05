"""Layered and embedded ground: waves that travel between the layers, exactly along the radius."""
