"""One analysis from its scene or saved model to the files of its result."""
