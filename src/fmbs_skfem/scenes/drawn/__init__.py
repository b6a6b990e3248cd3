"""Lines and plates that a scene draws, without a mesh file."""
