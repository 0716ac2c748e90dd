"""Brings the whole system up and down: the processes, and a client that knows when all of it is ready."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from types import TracebackType

from florence_bt.app.bringup.device_report import DeviceReport, report_missing
from florence_bt.app.bringup.fork_server import ForkServer
from florence_bt.app.bringup.heartbeat import KILLED_AFTER_S, SILENT_S
from florence_bt.app.bringup.hold import HungDriverStop, RobotHold, stop_base
from florence_bt.app.bringup.locks import lock_domain, lock_folder
from florence_bt.app.bringup.make_safe import BaseSafety
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.preflight import check_options
from florence_bt.app.bringup.private_files import owner_only
from florence_bt.app.bringup.process_report import ProcessReport
from florence_bt.app.bringup.signals import ignored, once
from florence_bt.app.bringup.simulated import clear_ports, with_places, with_world_files
from florence_bt.app.bringup.supervisor import RESTARTS_PERIOD_S, ProcessDied, Supervisor
from florence_bt.app.bringup.topology import (
    BASE,
    MISSIONS,
    companions,
    ended_together,
    loaded_for,
    observers,
    own_bindings,
    process_of,
    processes,
)
from florence_bt.app.demo.kernel_cache import ensure_compiled
from florence_bt.app.runs.client import ACTIVE_STATES, RUN_MISSION, MissionClient
from florence_bt.core.errors import ConfigError, DeviceTimeout, FlorenceError
from florence_bt.core.serving import ActionBinding, NodeBinding
from florence_bt.core.topic_names import SUPERVISOR
from florence_bt.ros.open_goals import OpenGoals
from florence_bt.skills.served import ACTIONS

READY_BUDGET_S = 180.0
"""Wall seconds that all nodes get to start, and then the devices of a simulation to answer."""
DEVICES_S = 6.0
"""Wall seconds that the devices of a robot get to answer, and the robot to know its pose, before "ready"."""
READY_LOOK_S = 0.1
"""Wall seconds between two looks whether all is ready: more of them slow down the start itself."""
LAST_RUN_S = 2.0
"""Wall seconds that the run gets to end in when a process died on it."""


class System:
    """A running system. Use as a context manager: leaving it stops the robot and ends every process.

    Args:
        options: What to bring up.
        report: Called with short lines about what goes on.
        fork_server: One that has begun to import already; ended with the system. Another one is started if
            none is given.

    Raises:
        ConfigError: A file of the bring-up is wrong, or another one uses the folder or the domain; nothing
            was started.
    """

    def __init__(
        self, options: BringUp, report: Callable[[str], None], fork_server: ForkServer | None = None
    ) -> None:
        folder = Path(options.folder)
        self._say, self._began = report, time.monotonic()
        with ExitStack() as stack:
            self._fork_server = stack.enter_context(fork_server or ForkServer(folder))
            check_options(options, report)
            stack.enter_context(owner_only(folder, options.runs))
            locks = [
                stack.enter_context(closing(lock(folder)))
                for lock in (lock_folder, partial(lock_domain, robot=options.namespace))
            ]
            if options.in_flat:
                clear_ports(options)
            self.options = options = with_places(with_world_files(options))
            self._base, self._missions = process_of(BASE, options), process_of(MISSIONS, options)
            self._observers = observers(options)
            self._supervisor = Supervisor(
                options.write(),
                folder / "logs",
                self._fork_server.fork,
                ended_together=ended_together(options),
                keep_open=[lock.fileno() for lock in locks],
                after_death=self._after_death,
            )
            port = HungDriverStop(options)
            self.client = MissionClient(SUPERVISOR)
            self._devices = DeviceReport(self.client.robot)
            self._processes = ProcessReport(self.client.node, self._supervisor, folder / "logs")
            self._hold = RobotHold(self.client, port)
            self._hung: set[str] = set()
            self._safety: BaseSafety | None = None
            self._starting_again: dict[str, float] = {}
            self._going_down = False
            self._interrupts = ExitStack()
            self._held_open = stack.pop_all()

    def __enter__(self) -> System:
        """Start the processes; they are not ready yet."""
        self._interrupts.enter_context(once())
        try:
            if not self.options.missions_only:
                ensure_compiled(self._report)
            groups = processes(self.options)
            self._report(f"starting {', '.join(groups)}")
            for group in groups:
                self._fork_server.load(loaded_for(group, self.options))
                self._supervisor.start([group])
        except BaseException:
            self._down()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop everything."""
        try:
            if isinstance(error, ProcessDied):
                self._held(driver_answers=error.name != self._base)
                self._stop_the_runs(error, "so the whole system ends")
        finally:
            self._down()

    def wait_ready(self) -> float:
        """Wait until our own nodes are ready. A robot may still need its pose, and other people's servers.

        Returns:
            Wall seconds since this was made.

        Raises:
            ProcessDied: A process ended.
            ConfigError: Another system runs in the same ROS domain.
            DeviceTimeout: It takes too long; names what is missing.
        """
        if not self.client.spin_until(
            self._is_ready, READY_BUDGET_S, watch=self._check_start, every_s=READY_LOOK_S
        ):
            missing = ", ".join(self._not_served() or self._not_up()) or "the robot's pose"
            raise DeviceTimeout(
                f"not ready after {READY_BUDGET_S:.0f} s, missing: {missing}; "
                f"see the logs in {self.options.folder}/logs"
            )
        # Emulated devices are there, but on a busy machine their drivers find them late. Nav2 may be not.
        budget_s = READY_BUDGET_S if self.options.in_flat and self._knows_pose_itself else DEVICES_S
        if self.options.base == "running":
            return time.monotonic() - self._began
        self.client.spin_until(self._devices_answer, budget_s, watch=self._check_start, every_s=READY_LOOK_S)
        report_missing(self._devices, self._report)
        return time.monotonic() - self._began

    def pids(self) -> dict[str, int]:
        """Return the process ids by name."""
        return self._supervisor.pids()

    def check(self) -> None:
        """Raise when a process has died; stop the robot while one does not answer. Call it often.

        A process that stays silent is killed, which the next call raises. For an observer nothing stops, and
        it is started again.

        Raises:
            ProcessDied: Names it.
        """
        self._check_deaths()
        # One that is started again has a budget to come up in, as at the start; the robot is held meanwhile.
        silences = {
            name: silent_s
            for name, silent_s in self._supervisor.silences().items()
            if name not in self._starting_again
        }
        hung = {name for name, s in silences.items() if s >= SILENT_S and name not in self._observers}
        for name in sorted(hung - self._hung):
            self._stop_for(name, hung)
        if self._base in self._hung & hung:
            self._hold.stop_by_port()
        for name in sorted(self._hung & silences.keys() - hung):
            self._report(f"the process {name!r} answers again")
        self._hung = hung
        if self._hold.held and not hung and not self._starting_again:
            self._hold.release()
            self._report("the robot may drive again")
        for name, silent_s in silences.items():
            if silent_s >= KILLED_AFTER_S:
                self._supervisor.kill(name, f"did not answer for {KILLED_AFTER_S:g} s and was killed")

    def _check_deaths(self) -> None:
        """Raise when a process has died without which the robot cannot go on."""
        try:
            self._supervisor.check()
        except ProcessDied as death:
            if death.name not in self._observers:
                raise
            pause = self._supervisor.start_again(death.name)
            if pause is None:
                self._supervisor.give_up(death.name)
            again = "not started again, as it died too often"
            if pause is not None:
                again = f"started again{f' in {pause:g} s' if pause else ''}"
            self._report(f"{death.what}, see {death.log_file}; the robot goes on, it is {again}", "ERROR")

    def _stop_for(self, name: str, hung: set[str]) -> None:
        """Hold the robot because a process does not answer, then say so."""
        done = self._held(driver_answers=self._base not in hung)
        line = f"the process {name!r} has not answered for {SILENT_S:.1f} s; {done}"
        self._report(line, "WARN")
        self._supervisor.note(name, line)
        self._supervisor.write_stack(name)

    def _held(self, *, driver_answers: bool) -> str:
        """Hold the robot; gives what was done, for people."""
        problem = self._hold.hold(driver_answers=driver_answers)
        return (
            f"the base may still be driving, switch it off: {problem}" if problem else "the robot is stopped"
        )

    def keep_up(self) -> None:
        """Check as :meth:`check` does, but start a process that died again, where that is safe.

        The robot is stopped meanwhile, and what it did is over: for the mission server its journal says how
        that goes on, of any other process the run ends with what happened. Not started again is the simulated
        world, where the robot would be somewhere else, and what has died too often.

        Raises:
            ProcessDied: A process died that is not started again.
        """
        try:
            self.check()
        except ProcessDied as death:
            if not self._start_again(death):
                raise
        self._processes.publish()
        not_up = self._supervisor.waiting() | set(self._not_up()) if self._starting_again else set()
        for name, deadline in tuple(self._starting_again.items()):
            if name not in not_up:
                del self._starting_again[name]
                self._report(f"the process {name!r} is up again; see florence runs for what it was doing")
                if self._starting_again:  # its velocity filter, if it has one, knows of no hold
                    self._held(driver_answers=True)
            elif time.monotonic() > deadline:
                del self._starting_again[name]
                self._supervisor.kill(name, f"was not up again after {READY_BUDGET_S:.0f} s and was killed")

    def _start_again(self, death: ProcessDied) -> bool:
        """Stop the robot, end what it does, and plan the start of a process; False when it stays dead."""
        others = companions(death.name, self.options)
        if others is None:
            return False
        pause = self._supervisor.start_again(death.name)
        if pause is None:
            times = self._supervisor.restarts(death.name)
            self._report(
                f"the process {death.name!r} has been started again {times} times in "
                f"{RESTARTS_PERIOD_S / 60:.0f} min: not once more",
                "ERROR",
            )
            return False
        done = self._held(driver_answers=death.name != self._base)
        with_others = f" with {' and '.join(map(repr, others))}" if others else ""
        when = f" in {pause:g} s" if pause else ""
        self._report(
            f"{death.what}, see {death.log_file}; {done}, the process is started again{with_others}{when}",
            "ERROR",
        )
        self._stop_the_runs(death, "which is started again")
        if death.name != self._base:
            self._hold_still()
        self._supervisor.start_along(others, death.name)
        deadline = time.monotonic() + pause + READY_BUDGET_S
        self._starting_again |= dict.fromkeys((death.name, *others), deadline)
        return True

    def _report(self, line: str, level: str = "INFO") -> None:
        """Say a line, and keep it among the logs."""
        self._say(line)
        self._processes.write(line, level)

    def _is_ready(self) -> bool:
        if self._not_up() or self._not_served():
            return False
        return not (self.options.simulated and self._knows_pose_itself) or self.client.knows_pose()

    @property
    def _knows_pose_itself(self) -> bool:
        """Tell whether our own localisation says where the robot is."""
        return self.options.nav == "own"

    def _devices_answer(self) -> bool:
        return not self._devices.missing() and self.client.knows_pose()

    def _not_served(self) -> list[str]:
        """Return the actions and services of our own nodes that have no server yet."""
        node = self.client.node
        names = {name for name, _ in node.get_service_names_and_types()}
        needed = {node.resolve_service_name(RUN_MISSION): RUN_MISSION}
        for served in own_bindings(self.options):
            if isinstance(served, ActionBinding):
                needed[f"{node.resolve_action_name(served.name)}/_action/send_goal"] = served.name
            elif isinstance(served, NodeBinding):
                needed[node.resolve_service_name(served.name)] = served.name
        return [shown for name, shown in needed.items() if name not in names]

    def _not_up(self) -> list[str]:
        """Return the processes that have not all their nodes yet; an earlier bring-up left other ids."""
        needed = {name: pid for name, pid in self.pids().items() if name not in self._observers}
        return [name for name, pid in needed.items() if self._id_in(name) != str(pid)]

    def _id_in(self, group: str) -> str:
        try:
            return self.options.up_file(group).read_text(encoding="utf-8").strip()
        except OSError:
            return ""

    def _check_start(self) -> None:
        """Check what may go wrong before all is ready, also what another user or machine runs."""
        self._check_deaths()
        self._supervisor.silences()  # taken, not judged: processes that start keep each other waiting
        if self.client.servers() > 1:
            raise ConfigError(
                "another system runs in the same ROS domain and namespace",
                valid=[
                    "another domain, e.g. ROS_DOMAIN_ID=7",
                    "--namespace /robot2",
                    "ending that one first",
                ],
            )

    def _after_death(self, name: str) -> str:
        if name != self._base:
            return ""
        done = stop_base(self.options)
        if self._going_down:
            self.client.node.get_logger().error(f"the process {name!r} did not end cleanly; {done}")
        return done

    def _hold_still(self) -> None:
        """Cancel what moves the robot and command zero until it stands; works while the client spins."""
        self._safety = self._safety or BaseSafety(self.client.node, OpenGoals(self.client.node, ACTIONS))
        self._safety.make_safe()

    def _stop_the_runs(self, death: ProcessDied, then: str) -> None:
        """Stop every run with the reason, as long as the mission server can record it.

        To be done before goals are cancelled or servers end: runs would fail for that reason.
        """
        if death.name == self._missions or self.client.state.state not in ACTIVE_STATES:
            return
        try:
            # Those that wait first: none may begin.
            for run_id in (*self.client.status().waiting, ""):
                self.client.stop(f"{death.what}, {then}", run_id)
            self.client.spin_until(lambda: self.client.state.state not in ACTIVE_STATES, LAST_RUN_S)
        except FlorenceError as error:
            self.client.node.get_logger().warning(f"the runs were not stopped: {error}")

    def _down(self) -> None:
        """End everything, and ignore further signals: half of it would leave the base driving.

        The wheels stop first. Then the mission process ends: it cancels its goals while navigation is there.
        """
        with ignored():
            self._going_down = True
            try:
                if self._base in self._supervisor.silences():
                    self._hold.hold(driver_answers=self._base not in self._hung, hand=True)
            finally:
                self._end()

    def _end(self) -> None:
        """End every process and release everything."""
        for name in self._supervisor.stop():
            self.client.node.get_logger().error(f"the process {name!r} did not end in time and was killed")
        if self.options.in_flat:
            clear_ports(self.options)
        self.client.close()
        self._held_open.close()
        self._interrupts.close()
