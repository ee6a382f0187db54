(Helix of radius 20 mm and pitch 10 mm, two turns)
G17 G21 G90 G94
G64 P0.001
F960
G1 X20 Y0 Z0
G4 P0.5
G3 X20 Y0 Z10 I-20 J0
G3 X20 Y0 Z20 I-20 J0
M2
