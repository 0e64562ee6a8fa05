"""The node: its life cycle around one watch per machine, and the process that runs it."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, ExitStack
from functools import partial
import gc
import sys
import traceback
from types import TracebackType
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import (
    LifecycleNode,
    LifecyclePublisher,
    LifecycleState,
    TransitionCallbackReturn,
)
from rclpy.logging import get_logger, LoggingSeverity, set_logger_level
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from rotorsoil_ros.case import cache
from rotorsoil_ros.case.loading import load_all, reload
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import plants_of
from rotorsoil_ros.errors import BAD_INPUT, InputError, RotorSoilError
from rotorsoil_ros.node.criteria_feed import Bench
from rotorsoil_ros.node.endpoint import OUTPUT, Watch
from rotorsoil_ros.node.parameters import described
from rotorsoil_ros.node.reload import Reloader
from rotorsoil_ros.node.run_log import LogSettings, RunLog
from rotorsoil_ros.node.settings import key, of_discs, Settings
from rotorsoil_ros.node.together import acquaint, refuse_clashes, Together, told_of
from rotorsoil_ros.stop import Stop
from rotorsoil_ros.wire.definitions import DIAGNOSTICS
from rotorsoil_ros.wire.messages import diagnostic_array, DIAGNOSTICS_TOPIC, NODE_NAME, Records

PERIOD_S = 1.0
FLUSH_S = 0.75  # what a kill takes from the log, with what writing takes, is less than a second
NAMESAKE_TICKS = 30  # a node that was killed stays in the graph for 20 s
SPIN_S = 0.1  # EventsExecutor dispatches nothing without a timeout; signals wait for it
SWITCH_S = 5e-4  # that an answer may wait for the thread that writes the log
EXECUTORS = {'events': EventsExecutor, 'single': SingleThreadedExecutor}


HELP = """usage: rotorsoil_node --ros-args -p machines:="[fan]" -p fan.case:=FAN.yaml [-p ...]
       rotorsoil_node --ros-args --params-file FILE [-r __ns:=/hall_2]

Publishes what each machine should do at the speed that it reports. Ends with status 0 when it is
asked to stop, with 2 and one line where a file, a parameter or an argument is wrong.

parameters (default):
{}"""


class RotorsoilNode(LifecycleNode):  # type: ignore[misc]
    """
    Publishes what each machine should do at the speed that it reports.

    Configured it holds tables and logs, active it answers, inactive it is silent.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(NODE_NAME, **options)
        self.settings = Settings(self)
        self._watches: dict[str, Watch] = {}
        self._plants: dict[str, Together] = {}  # by the name of each machine in them
        self._reloaders: dict[str, Reloader] = {}
        self._log: RunLog | None = None
        self._diagnostics: LifecyclePublisher | None = None
        self._bench: Bench | None = None
        self._turn, self._topics = 0, set[str]()
        self._namesake_ticks = 0
        self._held = ExitStack()
        self.add_post_set_parameters_callback(self._take_parameters)

    @property
    def lifecycle_state(self) -> str:
        """Label of the state: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def start(self) -> bool:
        """Configure and activate; return whether the node is active."""
        return bool(self.trigger_configure() == TransitionCallbackReturn.SUCCESS
                    and self.trigger_activate() == TransitionCallbackReturn.SUCCESS)

    def release(self) -> None:
        """Finish the logs and let go of tables, topics and timers; a second time does nothing."""
        self._held.close()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load the tables, open the logs, enter the graph."""
        with ExitStack() as stack:
            stack.push(self._tell_unexpected)
            try:
                self._configure()
            except (RotorSoilError, OSError) as error:
                self.get_logger().error(str(error))
                self.release()
                return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Publish."""
        result = super().on_activate(state)
        for watch in self._watches.values():
            watch.begin(self._now_ns())
        self.get_logger().info('active')
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Fall silent; logs stay open."""
        for watch in self._watches.values():
            watch.is_active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to before the configuration."""
        self.release()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave."""
        self.release()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to before the configuration after something unexpected."""
        self.release()
        return super().on_error(state)

    def _configure(self) -> None:
        settings, held = self.settings, self._held
        settings.check()
        machines = self._load()
        held.callback(self._forget)
        for name, machine in machines.items():
            held.callback(settings.forget_unbalance, name)
            settings.declare_unbalance(name, machine)
        logger = self.get_logger()
        log = RunLog(
            self._log_settings(), machines, tell=logger.info, complain=logger.error)
        held.callback(log.close)
        bench = Bench(cache.directory(settings.cache), complain=logger.error)
        held.callback(bench.close)
        diagnostics = self.create_lifecycle_publisher(DiagnosticArray, DIAGNOSTICS_TOPIC, OUTPUT)
        held.callback(self.destroy_lifecycle_publisher, diagnostics)
        self._log, self._diagnostics, self._bench = log, diagnostics, bench
        self._watch(machines, log, diagnostics, bench)
        self._hand_out(settings.unknown())
        for period_s, act in ((PERIOD_S / len(machines), self._tick), (FLUSH_S, log.flush)):
            timer = self.create_timer(
                period_s, act, clock=Clock(clock_type=ClockType.STEADY_TIME))
            held.callback(self.destroy_timer, timer)
        settings.is_locked = True
        where = f', log {log.path}' if log.path else ''
        self.get_logger().info(f'watching {", ".join(machines)}{where}')

    def _watch(
        self, machines: dict[str, Machine], log: RunLog, diagnostics: LifecyclePublisher,
        bench: Bench,
    ) -> None:
        """Take part in the graph for every machine, plant and entry."""
        plants = plants_of(machines)
        refuse_clashes(plants, machines)
        for plant, among in plants.items():
            together = Together(self, plant, among, log=log, diagnostics=diagnostics)
            self._held.callback(together.destroy)
            self._plants |= dict.fromkeys(among, together)
        for name, machine in machines.items():
            self._watches[name] = watch = Watch(
                self, name, machine, settings=self.settings, log=log, diagnostics=diagnostics,
                bench=bench, told=told_of(name, machines, plants, self.settings),
                plant=self._plants.get(name))
            self._held.callback(watch.destroy)
        self._acquaint(machines)
        for entry in self.settings.files:
            self._reloaders[entry] = reloader = Reloader(
                self, entry, load=partial(self._load_again, entry),
                take=partial(self._take, entry))
            self._held.callback(reloader.destroy)

    def _acquaint(self, names: Collection[str]) -> None:
        """Let machines, and those on the same blocks, know of each other."""
        watches = self._watches.items()
        acquaint(names, {name: watch.machine for name, watch in watches},
                 {name: watch.monitor for name, watch in watches})

    def _hand_out(self, slips: Sequence[str]) -> None:
        """Let each machine tell what is wrong with how it was set up; the first what is of all."""
        of_whom: dict[str, list[str]] = {name: [] for name in self._watches}
        for slip in slips:
            own = [name for name in of_whom if slip.startswith(f'parameter {key(name)}.')]
            # Of a plant the first machine tells what is of none of them.
            of_plant = [name for name in of_whom
                        if slip.startswith(f'parameter {name.partition("/")[0]}.')]
            of_whom[[*own, *of_plant, *of_whom][0]].append(slip)
        for name, watch in self._watches.items():
            watch.monitor.health.slips = tuple(of_whom[name])

    def _load(self) -> dict[str, Machine]:
        """Load every machine, each case file once."""
        files = {name: file for each in self.settings.files.values()
                 for name, file in each.items()}
        by_file = load_all(files.values(), cache_directory=self.settings.cache,
                           tell=self.get_logger().info)
        return {name: by_file[file] for name, file in files.items()}

    def _load_again(self, entry: str) -> dict[str, Machine]:
        """Load a machine, or all of a plant, which have to be those that are watched."""
        files, before = self.settings.case_files(entry), self.settings.files[entry]
        if files.keys() != before.keys():
            raise InputError(f'{entry}: machines must be {", ".join(before)} as before, got '
                             f'{", ".join(files)}; to watch others clean up and configure again')
        by_file = reload([*files.values()], cache_directory=self.settings.cache)
        return {name: by_file[file] for name, file in files.items()}

    def _take(self, entry: str, machines: dict[str, Machine]) -> str:
        """Answer from other cases; return what to say of it."""
        watches = [self._watches[name] for name in machines]
        plant, machine = watches[0].plant, machines[watches[0].name]
        if plant is not None and plant.name == entry:
            plant.take_channels(machine.table.channels)
        said = {watch.take_machine(machines[watch.name]) for watch in watches}
        self._acquaint(machines)
        return f'{entry}: reloaded {machine.case.path}{"".join(said)}'

    def _forget(self) -> None:
        self.settings.is_locked = False
        self._turn = 0
        self._watches, self._log, self._diagnostics, self._bench = {}, None, None, None
        self._plants, self._reloaders = {}, {}

    def _log_settings(self) -> LogSettings:
        value = self.settings.value
        return LogSettings(
            directory=value('log.directory'), name=value('log.name'), mcap=value('log.mcap'),
            rerun=value('log.rerun'), rerun_url=value('log.rerun_url'),
            split_mib=value('log.split_mib'), split_s=value('log.split_s'),
            budget_mib=value('log.budget_mib'))

    def _tick(self) -> None:
        """Once a second of wall time for each machine, and for what they share."""
        turn, self._turn = self._turn, (self._turn + 1) % len(self._watches)
        if turn == 0:
            self._topics = {name for name, _ in self.get_topic_names_and_types()}
            self._look_for_namesakes()
            if self._bench is not None:
                self._bench.step()
            if self._log is not None:
                self._report_log(self._log)
        # In turns: fifty at once would keep the speeds of all waiting.
        watch, stale_after_s = [*self._watches.values()][turn], float(
            self.settings.value('stale_after_s'))
        watch.tick(self._now_ns(), stale_after_s=stale_after_s, topics=self._topics)
        if watch.plant is not None and [*watch.plant.monitors][-1] == watch.name:
            watch.plant.tick(self._now_ns(), stale_after_s=stale_after_s)

    def _look_for_namesakes(self) -> None:
        """Tell if another node has the same name: both answer on the same topics."""
        own = self.get_name(), self.get_namespace()
        count = self.get_node_names_and_namespaces().count(own)
        before, self._namesake_ticks = self._namesake_ticks, (
            self._namesake_ticks + 1 if count > 1 else 0)
        if self._namesake_ticks == NAMESAKE_TICKS:
            self._hand_out([*self.settings.unknown(), (
                f'{count} nodes are called {self.get_fully_qualified_name()}: answers are given '
                'more than once; rename one with __node or __ns')])
        elif before >= NAMESAKE_TICKS and not self._namesake_ticks:
            self._hand_out(self.settings.unknown())

    def _report_log(self, log: RunLog) -> None:
        """Say on /diagnostics, and so in the log itself, how logging goes."""
        report = log.report(self._now_ns())
        if report is not None and self._diagnostics is not None and self._diagnostics.is_activated:
            payload = diagnostic_array(report, node=self.get_fully_qualified_name().strip('/'))
            self._diagnostics.publish(payload)
            log.write(Records(
                self._diagnostics.topic_name, DIAGNOSTICS, [report.stamp_ns], [payload]))

    def _take_parameters(self, parameters: list[Parameter]) -> None:
        for watch in () if self.settings.is_changing else self._watches.values():
            own = of_discs(watch.name)
            if any(parameter.name.startswith(own) for parameter in parameters):
                watch.take_unbalance(self._now_ns())

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _tell_unexpected(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Tell what rclpy would swallow in a transition."""
        if isinstance(error, Exception):
            self.get_logger().error(''.join(traceback.format_exception(kind, error, trace)))


class Survived:
    """
    Tells what a callback raised, each kind once, and goes on.

    The one place in the package that does so: a callback is made to raise nothing, and what it
    raises all the same is a fault of ours or of a library, of which no list can be complete. A
    node that watches fifty machines must not fall silent for one message of one of them.
    """

    def __init__(self, complain: Callable[[str], object]) -> None:
        self._complain = complain
        self._told: set[str] = set()

    def __enter__(self) -> None:
        pass

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> bool:
        if not isinstance(error, Exception) or isinstance(error, ExternalShutdownException):
            return False
        where = traceback.extract_tb(trace)[-1]
        place = f'{type(error).__name__} in {where.name}, line {where.lineno}'
        if place not in self._told:
            self._told.add(place)
            self._complain(''.join(traceback.format_exception(kind, error, trace))
                           + 'The node goes on; please report this.')
        return True


@contextmanager
def _refused_by_ros() -> Iterator[None]:
    """Turn what rclpy says of its arguments into one line for a user."""
    set_logger_level('rcl', LoggingSeverity.FATAL)  # it would say the half of it first
    try:
        yield
    except UnknownROSArgsError as error:
        raise InputError(f'arguments after --ros-args must be known, got {error}') from error
    except (RCLError, NameValidationException, ParameterException) as error:
        # What follows a file of the library is for its authors.
        said = ' '.join(str(error).split()).partition(', at /')[0]
        raise InputError(said.removeprefix('failed to initialize rcl: ')) from error
    finally:
        set_logger_level('rcl', LoggingSeverity.UNSET)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until it is asked to stop; return 0, or 2 where it could not start."""
    given = list(sys.argv if arguments is None else arguments)
    plain = given[1:given.index('--ros-args')] if '--ros-args' in given else given[1:]
    if {'-h', '--help'} & set(plain):
        sys.stdout.write(HELP.format(described()) + '\n')
        return 0
    stop = Stop()
    with ExitStack() as stack:
        try:
            if plain:
                raise InputError('arguments must stand behind --ros-args, got '
                                 f'{" ".join(plain)} (see --help)')
            with _refused_by_ros():
                rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
                stack.callback(rclpy.try_shutdown)
                node = RotorsoilNode()
            stack.callback(node.destroy_node)
            executor = EXECUTORS[node.settings.value('executor')]()
            stack.callback(executor.shutdown)
            executor.add_node(node)
            stack.callback(node.release)
            with stop.interrupting():
                if node.settings.value('autostart') and not node.start():
                    return BAD_INPUT
            sys.setswitchinterval(SWITCH_S)
            gc.freeze()  # tables and classes stay: looking for garbage among them costs latency
            survived = Survived(node.get_logger().error)
            while not stop.requested and node.context.ok():
                with survived:
                    # Returns after SPIN_S; `spin_once` would return after every message.
                    executor.spin_until_future_complete(Future(), timeout_sec=SPIN_S)
        except InputError as error:
            get_logger(NODE_NAME).error(str(error))
            return BAD_INPUT
        except (KeyboardInterrupt, ExternalShutdownException):
            pass
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
