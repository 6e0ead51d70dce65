def run_address(root, options):
    return "nothing", 0
def run_threads(root, options):
    return "nothing", 0
