"""Performance model: the time of a step on many ranks from particles, halo area, latency, bandwidth and gravity mesh.

Two equal spheres that touch at 15 degrees, cut into slabs on planes of blocks of four cells: the matter of the flagship
impact. Cells are the unit of length, seconds that of time. docs/scaling.md explains the terms.
"""

import dataclasses
import math

BLOCK = 4  # cells along an edge of a block
CHANNELS = 8  # values of a node that travel
HALO_PLANES = 2  # planes of nodes that a rank reaches behind a cut
MARGIN = 2  # cells that a tile reaches beyond its particles
HALO_MARGIN = MARGIN + 0.5 * BLOCK  # and whole blocks travel
TILE = 21.6  # particles that cost as much as a tile does by itself, on a host core (breccia_bench work)
# Share of a padded mesh that a transposition moves: halves that are zero stay where they are. From the bytes that four
# ranks sent (docs/performance.md): 12.9 MB an evaluation at 1e6 particles.
TRANSPOSED = 0.4
REPLICATED_NODES = 1e6  # docs/method.md: padded nodes up to which each rank transforms the whole mesh


@dataclasses.dataclass(frozen=True)
class Machine:
    """Costs on one rank (a core or a device) and of its network."""

    name: str
    particle: float  # engine, sorting included, of a particle in a step [s]
    tile: float  # engine, of a tile in a step besides [s]
    fixed: float  # engine, of a step without particles: launches, barriers [s]
    latency: float  # of a message [s]
    bandwidth: float  # of a rank to its neighbours and of its share of a transposition [B/s]
    gravity_particle: float  # an evaluation's near field, of a particle [s]
    gravity_node: float  # an evaluation's transforms, of a mesh node [s]
    word: int = 4  # bytes of a grid value
    hidden: float = 0.0  # share of the halo's time that interior work hides


@dataclasses.dataclass(frozen=True)
class Case:
    """What is computed."""

    particles: float
    per_cell: float = 1.412  # particles in a cell
    interval: int = 32  # steps between evaluations of gravity; 0: no gravity
    mesh_cell: float = 1.16  # mesh cell in grid cells: 1.3 mean distances of particles
    angle: float = math.radians(15.0)  # of the line of centres with the axis that slabs cut across

    @property
    def radius(self):
        """Of a sphere [cells]."""
        return (0.5 * self.particles / self.per_cell * 3.0 / (4.0 * math.pi)) ** (1.0 / 3.0)


def plane_cells(case):
    """Cells of matter in each plane of blocks across both spheres, from one end to the other."""
    radius = case.radius
    apart = 2.0 * radius * math.cos(case.angle)
    planes = max(1, math.ceil((apart + 2.0 * radius) / BLOCK))

    def below(x):
        """Volume of both spheres up to x."""

        def cap(h):
            h = min(max(h, 0.0), 2.0 * radius)
            return math.pi * h * h * (radius - h / 3.0)

        return cap(x) + cap(x - apart)

    return [below(BLOCK * (p + 1)) - below(BLOCK * p) for p in range(planes)]


def union_of_discs(a, b, apart):
    """Area of two discs with radii a and b whose centres are so far apart; a radius of 0 is no disc."""
    if min(a, b) <= 0.0 or apart >= a + b:
        return math.pi * (a * a + b * b)
    if apart <= abs(a - b):
        return math.pi * max(a, b) ** 2
    at = (apart**2 + a**2 - b**2) / (2.0 * apart)  # of the common chord, from the first centre
    lens = (a**2 * math.acos(at / a) + b**2 * math.acos((apart - at) / b)
            - apart * math.sqrt(max(0.0, a**2 - at**2)))
    return math.pi * (a * a + b * b) - lens


def section(case, x, margin):
    """Cells of a cut through the spheres at x cells from the end, with a margin around them [cells]."""
    radius = case.radius

    def disc(centre):
        square = radius**2 - (x - centre) ** 2
        return math.sqrt(square) + margin if square > 0.0 else 0.0

    apart = 2.0 * radius
    return union_of_discs(disc(radius), disc(radius + apart * math.cos(case.angle)), apart * math.sin(case.angle))


def cuts(work, ranks):
    """Ends of slabs, as indices of planes, that leave the least work to the busiest rank (mpi/slabs.cpp)."""
    before = [0.0]
    for w in work:
        before.append(before[-1] + w)

    def packed(limit):
        ends, start = [], 0.0
        for p in range(1, len(before)):
            if before[p] - start > limit:
                ends.append(p - 1)
                start = before[p - 1]
        return ends

    low, high = max(max(work), before[-1] / ranks), before[-1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        if len(packed(middle)) < ranks:
            high = middle
        else:
            low = middle
    return packed(high)


def halo_bytes(case, at, word):
    """Bytes that a rank sends in a step across a cut at plane `at`: sums of the nodes that its particles reach there, and
    velocities of its own that particles there reach."""
    x = BLOCK * at
    below, above = (max(section(case, x + reach, HALO_MARGIN) for reach in (0, side * MARGIN)) for side in (-1, 1))
    return HALO_PLANES * (below + above) * CHANNELS * word


@dataclasses.dataclass(frozen=True)
class Step:
    """Seconds of a step on the busiest rank."""

    engine: float
    halo: float
    gravity: float
    gravity_messages: float
    halo_bytes: float  # that the rank with the most sends
    imbalance: float  # largest over mean work
    busy_ranks: int

    @property
    def total(self):
        return self.engine + self.halo + self.gravity + self.gravity_messages


def gravity_seconds(case, machine, ranks, share):
    """Near field and transforms, and what the ranks send for them, of an evaluation [s]."""
    edge = 2.0 * case.radius / case.mesh_cell
    # An isolated box: twice the extent of the matter along each axis.
    nodes = 4 * edge * 2 * edge * 2 * edge
    # Each rank transforms all of a small mesh; a large one is cut into planes, and no more ranks than those work at it.
    sharing = 1 if nodes <= REPLICATED_NODES else max(1, min(ranks, int(4 * edge)))
    near = machine.gravity_particle * share
    work = near + machine.gravity_node * nodes / sharing
    if ranks == 1:
        return work, 0.0
    rounds = math.ceil(math.log2(ranks))
    if sharing == 1:
        # The mass of an eighth of the padded nodes, to all.
        return work, 2 * rounds * machine.latency + 8.0 * nodes / 8 / machine.bandwidth
    # Two transforms, each transposed; the mass comes in planes and the potential goes back.
    sent = 2 * 2 * TRANSPOSED * machine.word * nodes / sharing + 2 * 8.0 * (2 * edge) ** 2 * 4
    messages = 2 * ranks + 4 * rounds
    return work, messages * machine.latency + sent / machine.bandwidth


def step(case, machine, ranks):
    """The step of `case` on `ranks` ranks."""
    cells = plane_cells(case)
    # Engine work of a plane: particles, and its blocks.
    blocks = [section(case, BLOCK * (p + 0.5), 0.5 * BLOCK) / BLOCK**2 for p in range(len(cells))]
    work = [machine.particle * case.per_cell * c + machine.tile * b for c, b in zip(cells, blocks)]
    near = [machine.gravity_particle * case.per_cell * c for c in cells]
    if case.interval:
        work = [w + n / case.interval for w, n in zip(work, near)]
    ends = [0, *cuts(work, ranks), len(cells)]
    slabs = list(zip(ends, ends[1:]))
    busiest = max(slabs, key=lambda s: sum(work[s[0] : s[1]]))
    most = sum(work[busiest[0] : busiest[1]])
    sent = [sum(halo_bytes(case, at, machine.word) for at in slab if 0 < at < len(cells)) for slab in slabs]
    neighbours = 0 if ranks == 1 else 1 if len(slabs) == 2 else 2
    # Two phases, each with a message to each neighbour.
    exchange = 2 * neighbours * machine.latency + max(sent) / machine.bandwidth if len(slabs) > 1 else 0.0
    gravity = messages = 0.0
    share = case.per_cell * sum(cells[busiest[0] : busiest[1]])
    if case.interval:
        gravity, messages = (s / case.interval for s in gravity_seconds(case, machine, ranks, share))
        most -= machine.gravity_particle * share / case.interval
    return Step(
        engine=machine.fixed + most,
        halo=max(exchange - machine.hidden * most, (1.0 - machine.hidden) * exchange),
        gravity=gravity,
        gravity_messages=messages,
        halo_bytes=max(sent),
        imbalance=max(sum(work[a:b]) for a, b in slabs) * ranks / sum(work),
        busy_ranks=len(slabs),
    )


def speed_up(case, machine, ranks):
    return step(case, machine, 1).total / step(case, machine, ranks).total


def least_squares(rows, values):
    """The solution of rows x = values in the sense of least relative squares; a few unknowns, by normal equations."""
    n = len(rows[0])
    scaled = [[a / v for a in row] for row, v in zip(rows, values)]
    matrix = [[sum(r[i] * r[j] for r in scaled) for j in range(n)] + [sum(r[i] for r in scaled)] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(matrix[k][i]))
        matrix[i], matrix[pivot] = matrix[pivot], matrix[i]
        if abs(matrix[i][i]) < 1e-300:
            raise ValueError("the runs do not tell the terms of the model apart: more sizes are needed")
        for k in range(n):
            if k != i:
                f = matrix[k][i] / matrix[i][i]
                matrix[k] = [a - f * b for a, b in zip(matrix[k], matrix[i])]
    return [matrix[i][n] / matrix[i][i] for i in range(n)]


def fit(runs, network, name="this machine", word=4):
    """The machine of runs on one rank: dicts with `particles`, `per_cell`, `engine` and `gravity_particle`,
    `gravity_node` seconds of a step and of an evaluation (0: none). `network`: latency [s] and bandwidth [B/s]."""
    rows, values = [], []
    for run in runs:
        case = Case(run["particles"], run["per_cell"])
        blocks = sum(section(case, BLOCK * (p + 0.5), 0.5 * BLOCK) / BLOCK**2 for p in range(len(plane_cells(case))))
        rows.append([run["particles"], blocks])
        values.append(run["engine"])
    if len({run["particles"] for run in runs}) > 1:
        particle, tile = least_squares(rows, values)
    else:
        particle = least_squares([[n + TILE * tiles] for n, tiles in rows], values)[0]
        tile = TILE * particle
    near = [r["gravity_near"] / r["particles"] for r in runs if r.get("gravity_near")]
    mesh = []
    for run in runs:
        if run.get("gravity_mesh"):
            edge = 2.0 * Case(run["particles"], run["per_cell"]).radius / Case(1.0).mesh_cell
            mesh.append(run["gravity_mesh"] / (16 * edge**3))
    return Machine(
        name=name,
        particle=particle,
        tile=tile,
        fixed=0.0,
        latency=network[0],
        bandwidth=network[1],
        gravity_particle=sum(near) / len(near) if near else 0.0,
        gravity_node=sum(mesh) / len(mesh) if mesh else 0.0,
        word=word,
    )


# Assumptions, not measurements (docs/scaling.md): one device a rank, its memory's bandwidth half used, a message through
# InfiniBand NDR with kernels that pack it, gravity on the device.
H100 = Machine(
    name="H100, one a rank (assumed)",
    particle=0.4e-9,
    tile=20e-9,
    fixed=15e-6,
    latency=8e-6,
    bandwidth=20e9,
    gravity_particle=5e-9,
    gravity_node=0.15e-9,
    hidden=0.8,
)
