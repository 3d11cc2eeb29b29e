"""A second reading of scan, scene and package, apart from the product: NumPy, and readers of other people.

The modules of this package import nothing of volprep, and a test holds them to it. The results are compared in
`volprep.validation.witness.second_reading`.
"""
