(Square with round corners at 1 m/min, for servo_three_axis.yaml, whose load acts on the second and third)
G21 G17 G90 G94
G1 X30 F1000
G3 X50 Y20 R20
G1 Y60
G3 X30 Y80 R20
G1 X-10
G3 X-30 Y60 R20
G1 Y20
G3 X-10 Y0 R20
G1 X0
M2
