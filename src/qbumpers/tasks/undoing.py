def undo_of(env):
    return (env.get_wrapper_attr("snapshot"), env.get_wrapper_attr("restore"))


def reached_limit(env):
    return False
