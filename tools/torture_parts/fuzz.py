def add_options(parser):
    parser.add_argument("--seconds", type=int, default=600)
def run(root, options):
    return "nothing", 0
