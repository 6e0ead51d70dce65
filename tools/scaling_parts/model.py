"""Performance model: the time of a step on many ranks from particles, halo area, latency, bandwidth and gravity mesh.

Two equal spheres before they touch, cut into slabs across their line of centres, between planes of nodes: the matter of
the flagship impact. Cells are the unit of length, seconds that of time. docs/scaling.md explains the terms.
"""

import bisect
import dataclasses
import functools
import itertools
import math

BLOCK = 4  # cells along an edge of a block
CHANNELS = 8  # values of a node that travel
# How far outside of a sphere nodes may lie that have particles of it nearest to them [cells]; fitted once to the bytes of
# 20,000 to 1,000,000 particles. Half a cell of particles without gaps; a cell of one or two has none where it holds little
# of the sphere.
RIM = 0.25
# Where the layers of a body's lattice lie is not known to the model: means over so many places, evenly spaced.
PHASES = 16
MARGIN = 2  # nodes that a particle reaches beyond the nearest one until the next sorting
STACK = 4  # blocks of a tile of the host engine, along z
# Particles that cost as much as a tile does with its half empty last pack, on a host core: 1.7 us and 8 lanes of 32 ns, by
# which the program cuts (docs/scaling.md, "Balance").
TILE = 61.0
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
    whole_blocks: bool = False  # slabs are cut between blocks only
    stack: int = STACK  # blocks of a tile


@dataclasses.dataclass(frozen=True)
class Case:
    """What is computed."""

    particles: float
    per_cell: float = 1.412  # particles in a cell
    interval: int = 32  # steps between evaluations of gravity; 0: no gravity
    mesh_cell: float = 1.16  # mesh cell in grid cells: 1.3 mean distances of particles
    gap: float = 0.01  # between the spheres, in diameters

    @property
    def radius(self):
        """Of a sphere [cells]."""
        return (0.5 * self.particles / self.per_cell * 3.0 / (4.0 * math.pi)) ** (1.0 / 3.0)

    @property
    def apart(self):
        """Centre to centre [cells]."""
        return 2.0 * self.radius * (1.0 + self.gap)

    @property
    def layers(self):
        """Between layers of particles, of the face-centred cubic lattice that bodies are made of [cells]."""
        return 0.5 * (4.0 / self.per_cell) ** (1.0 / 3.0)


def centres(case):
    """Where the spheres stand along the axis that slabs cut across; the origin lies between them."""
    return (-0.5 * case.apart, 0.5 * case.apart)


def planes_of(case):
    """Planes of nodes with matter nearest to them, first and last."""
    end = math.floor(0.5 * case.apart + case.radius + RIM)
    return -end, end


def cells_up_to(case, x):
    """Volume of both spheres up to x."""

    def cap(h):
        h = min(max(h, 0.0), 2.0 * case.radius)
        return math.pi * h * h * (case.radius - h / 3.0)

    return sum(cap(x - (centre - case.radius)) for centre in centres(case))


def widest(case, first, last, phase):
    """Radius of the disc of nodes that have particles nearest to them, in that layer of particles nearest to the planes first
    ... last where it is largest; -1: there is none. Layers lie `phase` of their distance beside the centres."""
    radius = -1.0
    for centre in centres(case):
        near = max(first - 0.5 - centre, centre - last - 0.5, 0.0)
        away = (math.ceil(near / case.layers - phase) + phase) * case.layers if near else 0.0
        if away <= case.radius:
            radius = max(radius, math.sqrt(case.radius**2 - away**2) + RIM)
    return radius


def columns(radius, margin, stack=1):
    """Columns of blocks across the slabs that nodes meet which lie in a disc around the origin, or `margin` nodes beside
    it, in stacks of `stack` blocks along one side. Counted row by row: for large discs the area and half the perimeter of a
    square around it, 8 radius blocks."""
    if radius < 0.0:
        return 0
    count = 0
    height = BLOCK * stack
    reach = math.floor(radius) + margin
    for row in range(-reach // BLOCK, reach // BLOCK + 1):
        nearest = max(0, BLOCK * row - margin, -(BLOCK * row + BLOCK - 1) - margin)
        end = math.floor(math.sqrt(max(0.0, radius**2 - nearest**2))) + margin
        count += end // height - -end // height + 1
    return count


@functools.lru_cache(maxsize=None)
def mean_columns(case, first, last, margin, stack=1):
    """Columns that particles nearest to the planes first ... last meet, on average over where layers lie."""
    phases = ((n + 0.5) / PHASES for n in range(PHASES))
    return sum(columns(widest(case, first, last, phase), margin, stack) for phase in phases) / PHASES


@dataclasses.dataclass
class Planes:
    """Work of each plane of nodes, or of each `step` of them, from the first one on, and of the tiles of each plane of
    blocks (mpi/slabs.hpp)."""

    first: int
    before: list  # work of all planes before
    tiles: dict
    step: int = 1

    def __post_init__(self):
        self.tiles_up_to = dict(zip(sorted(self.tiles), itertools.accumulate(w for _, w in sorted(self.tiles.items()))))

    def work(self, begin, end):
        """Of the slab of the planes begin ... end - 1, counted from the first. A block that is cut costs both sides."""
        if begin == end:
            return 0.0
        one, last = (self.first + self.step * begin) // BLOCK, (self.first + self.step * end - 1) // BLOCK
        tiles = self.tiles_up_to[last] - self.tiles_up_to[one] + self.tiles[one]
        return self.before[end] - self.before[begin] + tiles


def planes_with_work(case, particle, tile, step=1, stack=STACK):
    first, last = planes_of(case)
    first -= first % step
    last += -(last + 1) % step
    before = [0.0]
    for plane in range(first, last + 1, step):
        cells = cells_up_to(case, plane + step - 0.5) - cells_up_to(case, plane - 0.5)
        before.append(before[-1] + particle * case.per_cell * cells)
    tiles = {b: tile * mean_columns(case, BLOCK * b, BLOCK * b + BLOCK - 1, 0, stack)
             for b in range(first // BLOCK, last // BLOCK + 1)}
    return Planes(first, before, tiles, step)


def cuts(planes, ranks):
    """Ends of slabs, as indices of planes, that leave the least work to the busiest rank and are as even as that allows
    (mpi/slabs.cpp)."""
    size = len(planes.before) - 1

    def furthest(begin, limit):
        return bisect.bisect_right(range(begin + 1, size + 1), limit, key=lambda e: planes.work(begin, e)) + begin

    def fits(limit):
        at = 0
        for _ in range(ranks):
            at = furthest(at, limit) if at < size else size
        return at == size

    low, high = 0.0, planes.work(0, size)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if fits(middle) else (middle, high)
    first = [size] * (ranks + 1)  # of each rank, so that those behind it can hold the rest
    for k in range(ranks - 1, 0, -1):
        at = first[k + 1]
        while at > 0 and planes.work(at - 1, first[k + 1]) <= high:
            at -= 1
        first[k] = at
    ends, begin = [], 0
    for k in range(1, ranks):
        share = planes.work(begin, size) / (ranks - k + 1)
        least, most = max(min(begin + 1, size), first[k]), furthest(begin, high) if begin < size else size
        begin = min(range(least, max(least, most) + 1), key=lambda e: abs(planes.work(begin, e) - share))
        if begin < size:
            ends.append(begin)
    return ends


def halo_bytes(case, at, word):
    """Bytes that each of two ranks sends in a step across a cut before plane `at`: sums of the nodes that its particles
    reach behind it, and velocities of its own that particles there reach."""
    found = 0
    for depth in range(MARGIN):
        found += mean_columns(case, at - MARGIN + depth, at - 1, MARGIN)  # particles below, nodes of at + depth
        found += mean_columns(case, at, at + MARGIN - 1 - depth, MARGIN)
    return found * BLOCK**2 * CHANNELS * word


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
    particle = machine.particle + (machine.gravity_particle / case.interval if case.interval else 0.0)
    planes = planes_with_work(case, particle, machine.tile, BLOCK if machine.whole_blocks else 1, machine.stack)
    ends = [0, *cuts(planes, ranks), len(planes.before) - 1]
    slabs = list(zip(ends, ends[1:]))
    shares = [planes.work(*slab) for slab in slabs]
    most = max(shares)
    busiest = slabs[shares.index(most)]
    crossing = {end: halo_bytes(case, planes.first + planes.step * end, machine.word) for end in ends[1:-1]}
    sent = [sum(crossing.get(end, 0) for end in slab) for slab in slabs]
    neighbours = 0 if ranks == 1 else 1 if len(slabs) == 2 else 2
    # Two phases, each with a message to each neighbour.
    exchange = 2 * neighbours * machine.latency + max(sent) / machine.bandwidth if len(slabs) > 1 else 0.0
    gravity = messages = 0.0
    share = (planes.before[busiest[1]] - planes.before[busiest[0]]) / particle
    if case.interval:
        gravity, messages = (s / case.interval for s in gravity_seconds(case, machine, ranks, share))
        most -= machine.gravity_particle * share / case.interval
    return Step(
        engine=machine.fixed + most,
        halo=max(exchange - machine.hidden * most, (1.0 - machine.hidden) * exchange),
        gravity=gravity,
        gravity_messages=messages,
        halo_bytes=max(sent),
        imbalance=most * ranks / sum(shares),
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
        rows.append([run["particles"], sum(planes_with_work(case, 0.0, 1.0).tiles.values())])
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


# Particles, tiles and launches from an H100's rates without gravity (docs/gpu.md, at 65 and at 376 particles a tile); the
# rest are assumptions (docs/scaling.md): a message through InfiniBand NDR with kernels that pack it, gravity on the device.
H100 = Machine(
    name="H100, one a rank (network and gravity assumed)",
    particle=0.23e-9,
    tile=22e-9,
    fixed=15e-6,
    latency=8e-6,
    bandwidth=20e9,
    gravity_particle=5e-9,
    gravity_node=0.15e-9,
    hidden=0.8,
    whole_blocks=True,
    stack=1,
)
