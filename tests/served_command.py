# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""Runs the loopbit command. Where the environment names a build of command_server.cpp in COMMAND_SERVER, that
does it, without loading all libraries again."""

import atexit
import os
import subprocess
import tempfile


TIME_LIMIT_S = 600    # no call takes a tenth of it; one that hangs should fail under its name


class Server:
    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        atexit.register(self.process.communicate)

    def run(self, command, cwd, environment):
        with tempfile.NamedTemporaryFile() as stdout, tempfile.NamedTemporaryFile() as stderr:
            variables = [f"{name}={value}" for name, value in environment.items()]
            strings = [cwd, stdout.name, stderr.name, str(len(variables)), *variables, *command]
            request = b"".join(os.fsencode(text) + b"\0" for text in [str(len(strings)), *strings])
            self.process.stdin.write(request)
            self.process.stdin.flush()
            code = int(self.process.stdout.readline())
            return subprocess.CompletedProcess(command, code, stdout.read().decode(), stderr.read().decode())


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
