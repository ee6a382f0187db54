(A container carried by 10 cm steps, as in the tests of specified-duration shapers)
(the trolley goes there, lets the container hang for five seconds, and comes back)
G21 G90 G94
G1 X100 F18000
G4 P5
G1 X0
M2
