"""The digital twin: an FR3 and the scenes of four tasks in MuJoCo, in process or served to a real client.

Everything here runs under MuJoCo 3.3.0 with NumPy 2 (training) and under MuJoCo 3.2.7 with NumPy 1.26 (the
served twin's environment), from the same files. Nothing measured here says anything about hardware.
"""
