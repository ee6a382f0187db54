(Square on its corner, from the middle of a side)
G17 G21 G90 G94
G64 P0.001
F960
G1 X15 Y15 Z0
G4 P0.5
G1 X0 Y30
G1 X-30 Y0
G1 X0 Y-30
G1 X30 Y0
G1 X15 Y15
M2
