"""Recording: the samples of a case that its report is made of, in memory that no length of program fills.

A million blocks make tens of millions of samples, more than memory should hold. So a sample goes two ways::

    Response, ContourError --> Recorder --+--> Extremes --> Signals          in memory: drawn, read
                                          +--> Spool    --> Signals.samples  in a nameless file: signals.npz

`Extremes` keeps up to 131,072 samples as they are. A longer motion it keeps in buckets of equal width, and of
each bucket the samples where the tool, the drives or the command is farthest from the path, where the tool is
nearest, and where following error, deflection, speed or acceleration is largest; where there are servo
motors also where torque, gain or what the observer misses of the load is largest. The width is a power of two
that goes with the number of samples, and the best of two buckets is the best of their bests: what is kept
does not depend on how the samples came in chunks. The worst places always stay.

The spool holds every sample until they are too many, beyond `KEPT`; then it goes, unless all are asked for.
So `signals.npz` has every sample, streamed column by column, or the same samples as the page.

The programmed path, as a polyline to draw, is thinned alike: a bucket keeps its outermost points.
"""

from cnc_shape.recording.outline import Outline
from cnc_shape.recording.recorder import KEPT, Recorder
from cnc_shape.recording.signals import MOTORS, PICKS, Samples, Signals, picks, require_finite

__all__ = ["KEPT", "MOTORS", "PICKS", "Outline", "Recorder", "Samples", "Signals", "picks", "require_finite"]
