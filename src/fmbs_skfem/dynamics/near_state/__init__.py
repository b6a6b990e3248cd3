"""Linear equations about a state: vibration modes, buckling, frequencies over a parameter, answers
to inputs.
"""
