"""Where the ranks of a series come from: the batch job this runs in, or the cores of this machine."""

import os
import shlex

ROOT_VARIABLES = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
}
# More ranks than cores, and none bound to a core that another job may be bound to: on one machine only.
LOCAL_VARIABLES = {
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
}


def ranks_of_job(environment):
    """Ranks that the batch system gives this job; None outside a job."""
    for name in ("SLURM_NTASKS", "PBS_NP", "PBS_TASKNUM"):
        if environment.get(name, "").isdigit():
            return int(environment[name])
    nodes = environment.get("PBS_NODEFILE")
    if nodes and os.path.exists(nodes):
        with open(nodes, encoding="ascii") as lines:
            return sum(1 for line in lines if line.strip())
    return None


def default_ranks(environment, cores):
    """Powers of two up to all ranks of the job, or to the cores of this machine, and that number itself."""
    most = ranks_of_job(environment) or cores
    ranks = [1]
    while ranks[-1] * 2 <= most:
        ranks.append(ranks[-1] * 2)
    return ranks if ranks[-1] == most else [*ranks, most]


def launcher(environment):
    """The command that starts {ranks} ranks."""
    if "SLURM_JOB_ID" in environment:
        return "srun --mpi=pmix --ntasks={ranks}"
    return "mpirun -n {ranks}"


def command(template, ranks, program):
    """`program` (a list) on `ranks` ranks; one rank goes through the launcher, too, as its binding counts."""
    return [*shlex.split(template.format(ranks=ranks)), *program]


def environment_for_runs(environment):
    """One thread a rank unless the user says otherwise; on one machine, what tools/mpi-environment sets."""
    variables = {"OMP_NUM_THREADS": "1", **environment}
    if os.geteuid() == 0:
        variables.update(ROOT_VARIABLES)
    if ranks_of_job(environment) is None:
        variables.update(LOCAL_VARIABLES)
    return variables
