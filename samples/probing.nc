(Probing cycle of a coordinate measuring machine)
(the column swings at 25 Hz; what is left of it in the pause is measured with the part)
G17 G21 G90 G94
G61
(gross move, 100 mm/s)
G0 X50
(pause: the probe shall hang still)
G4 P0.06
(approach, 8 mm/s, and the touch)
G1 Y4 F480
(retract, 60 mm/s)
G1 Y0 F3600
M2
