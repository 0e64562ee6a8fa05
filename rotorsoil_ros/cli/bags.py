"""Recorded profiles, answered offline or sent into the graph."""

from argparse import Namespace

from rotorsoil_ros.cli.progress import progress


def predict(arguments: Namespace) -> int:
    """Answer every speed of a profile and log it as the node would."""
    from rotorsoil_ros.live.machine import Machine
    from rotorsoil_ros.live.predict import predict as answer

    machine = Machine.load(
        arguments.case, cache_directory=arguments.cache, overrides=arguments.overrides)
    with progress('predicting') as report:
        answered = answer(machine, arguments.profile, arguments.output, rrd=arguments.rrd,
                          progress=report)
    counts = ', '.join(f'{number} {reason}' for reason, number in answered.counts.items())
    print(f'{arguments.output}: {answered.machine}: {counts}')
    return 0


def replay(arguments: Namespace) -> int:
    """Publish a recorded profile at its own timing, or faster or slower."""
    from rotorsoil_ros.live.replay import replay as publish

    with progress('replaying') as report:
        published = publish(arguments.profile, rate=arguments.rate, progress=report)
    print(f'{arguments.profile}: {published} messages published')
    return 0


def recover(arguments: Namespace) -> int:
    """Save everything readable of a log whose writer was killed."""
    from rotorsoil_ros.live.recover import recover as save

    with progress('recovering') as report:
        saved = save(arguments.broken, arguments.output, progress=report)
    print(f'{arguments.output}: {saved}')
    return 0
