(Circle of radius 5 mm, three laps)
G17 G21 G90 G94
G61
G0 X5 Y0 Z0
F960
G3 X5 Y0 I-5 J0
G3 X5 Y0 I-5 J0
G3 X5 Y0 I-5 J0
M2
