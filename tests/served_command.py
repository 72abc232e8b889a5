# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs the loopbit command. Where the environment names a build of command_server.cpp in COMMAND_SERVER, that
does it, without loading all libraries again."""

import atexit
import ctypes
import os
import subprocess
import tempfile


TIME_LIMIT_S = 600    # no call takes a tenth of it; one that hangs should fail under its name
PR_SET_CHILD_SUBREAPER = 36    # of <sys/prctl.h>: orphans of children become children


class Server:
    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        atexit.register(self.process.communicate)

    def ask(self, what, command, cwd, stdout, stderr, environment):
        variables = [f"{name}={value}" for name, value in environment.items()]
        strings = [what, cwd, stdout.name, stderr.name, str(len(variables)), *variables, *command]
        request = b"".join(os.fsencode(text) + b"\0" for text in [str(len(strings)), *strings])
        self.process.stdin.write(request)
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def run(self, command, cwd, environment):
        with tempfile.NamedTemporaryFile() as stdout, tempfile.NamedTemporaryFile() as stderr:
            code = self.ask("run", command, cwd, stdout, stderr, environment)
            return subprocess.CompletedProcess(command, code, stdout.read().decode(), stderr.read().decode())

    def start(self, command, stdout, stderr, environment):
        """The number of a new process, which is a child of this one."""
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        return self.ask("start", command, os.getcwd(), stdout, stderr, environment)


SERVER = Server(os.environ["COMMAND_SERVER"]) if "COMMAND_SERVER" in os.environ else None


def run_command(program, *arguments, environment=None, cwd=None, **options):
    """Options are those of subprocess.run(), for which a process of its own is started in any case."""
    command = [str(program), *map(str, arguments)]
    environment = environment or {}
    if SERVER and not options:
        return SERVER.run(command, cwd or os.getcwd(), environment)
    return subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        cwd=cwd,
        **{"timeout": TIME_LIMIT_S, **options},
    )
