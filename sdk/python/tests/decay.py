"""A small solver and a request for it."""

import numpy as np

from served import floats
from starlings import _solver_pb2 as pb

DECAY = """
    import starlings

    @starlings.solver(parameters={"rate": "1/s"}, states={"x": "m"}, outputs={"height": "m"}, inputs={"rise": "m/s"},
                      measures={"height": "x"}, dt=0.01)
    class Decay:
        "A height that falls."
        def initial(self, p):
            return [1.0]
        def rate(self, t, x, p, u):
            return [-p.rate * x[0] + u.rise]

    starlings.serve(Decay)
"""


def request(**changes):
    fields = dict(
        parameters=floats(0.5),
        start=0.0,
        times=floats(0.5, 1.0),
        outputs=["height"],
        observed=floats(np.nan, np.nan),
        inputs=[pb.Signal(times=floats(0.0, 1.0), values=floats(0.0, 0.0))],
    )
    fields.update(changes)
    return pb.RunRequest(**fields)
