"""The compiled time step, and how its equations are solved."""
