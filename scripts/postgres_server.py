# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
"""A PostgreSQL server of its own, for tests and benchmarks: in a temporary folder, on a Unix socket and a
free port of 127.0.0.1, by a user without privileges."""

import contextlib
import os
import pathlib
import random
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time

PASSWORD = "p%3Aw@rd/1"    # every letter of it has to be encoded in an address
ENCODED_PASSWORD = "p%253Aw%40rd%2F1"


def programs():
    """The folder of the newest installed server."""
    found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    if not found:
        raise SystemExit("PostgreSQL is not installed; scripts/setup test installs postgresql-15.")
    return found[-1].parent


def programs_with(extension, folder):
    """The folder of the same server with an extension, whose files are in a folder of their own. A server
    looks for them in places relative to its program. So a copy of the program sees the extension, and the
    installed server does not."""
    installed = programs()
    version = installed.parent.name
    root, system = folder / "usr", pathlib.Path("/usr")
    links = [f"lib/postgresql/{version}/lib", f"share/postgresql/{version}", f"share/postgresql/{version}/extension"]
    for part in links:
        (root / part).mkdir(parents=True)
        for file in (system / part).iterdir():
            if str((root / part / file.name).relative_to(root)) not in links:
                (root / part / file.name).symlink_to(file)
    copies = root / "lib/postgresql" / version / "bin"
    copies.mkdir()
    for program in ("initdb", "pg_ctl", "postgres"):
        shutil.copy(installed / program, copies)
    shutil.copy(extension / "loopbit.so", root / links[0])
    for file in (*extension.glob("loopbit*.control"), *extension.glob("loopbit--*.sql")):
        shutil.copy(file, root / links[2])
    return copies


def free_port():
    """Below those that Linux gives to connections, one of which could take it while the server is away."""
    while True:
        port = random.randrange(10000, 32768)
        with socket.socket() as probe, contextlib.suppress(OSError):    # it is taken
            probe.bind(("127.0.0.1", port))
            return port


def state(process):
    """As in proc(5): T for one that is stopped, Z for one that has ended, even if nothing of it is left."""
    try:
        status = pathlib.Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return "Z"
    return status.rsplit(")", 1)[1].split()[0]


def send(process, number):
    """Sends a signal. Returns whether the process is there: it may have ended meanwhile, or before and is only
    now forgotten by its parent."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, number)
        return True
    return False


def may_make_disks():
    """Whether this user may make a disk in memory: root may, but not in every container."""
    with tempfile.TemporaryDirectory() as folder:
        made = subprocess.run(["mount", "-t", "tmpfs", "tmpfs", folder], check=False, stderr=subprocess.DEVNULL)
        if made.returncode == 0:
            subprocess.run(["umount", folder], check=True)
        return made.returncode == 0


class PostgresServer:
    """A running server, whose superuser is "admin". With `safe`, commits are on disk. `extension`: the folder
    of a build with loopbit.so and what belongs to it; the server has it then. `limit_s`: for a call of sql().
    `disk_mb`: its data are on a disk of their own, in memory, of that size, see may_make_disks()."""

    def __init__(self, safe=False, extension=None, limit_s=None, disk_mb=None):
        self.limit_s = limit_s
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="loopbit_pg_"))
        self.disk = self.folder / "disk"
        self.data = self.disk / "data"
        self.disk.mkdir()
        self.has_own_disk = disk_mb is not None
        if self.has_own_disk:
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={disk_mb}m", "tmpfs", self.disk], check=True)
        self.port = free_port()
        self.process = None
        self.programs = programs_with(extension, self.folder) if extension else programs()
        self.as_nobody = {}
        if os.geteuid() == 0:
            for folder in (self.folder, self.disk):
                shutil.chown(folder, "nobody", "nogroup")
            self.as_nobody = {"user": "nobody", "group": "nogroup", "extra_groups": []}
        password = self.folder / "password"
        password.write_text(PASSWORD)
        password.chmod(0o644)
        self.call("initdb", "-D", self.data, "-U", "admin", "--pwfile", password, "-A", "scram-sha-256",
                  "-E", "UTF8", "--locale=C", "--no-sync")
        with (self.data / "postgresql.conf").open("a") as settings:
            settings.write(f"listen_addresses = '127.0.0.1'\nport = {self.port}\n"
                           f"unix_socket_directories = '{self.folder}'\n"
                           f"fsync = {'on' if safe else 'off'}\n")
        self.start()

    def call(self, program, *arguments):
        """Runs one of the server's programs."""
        subprocess.run([self.programs / program, *map(str, arguments)], check=True, cwd=self.folder,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **self.as_nobody)

    def start(self):
        log = self.folder / "log"
        try:
            self.call("pg_ctl", "-D", self.data, "-l", log, "-w", "-t", "60", "start")
        except subprocess.CalledProcessError as error:
            raise RuntimeError(f"The server does not start:\n{log.read_text()}") from error

    def processes(self):
        """Of the server, all of them stopped."""
        postmaster = int((self.data / "postmaster.pid").read_text().splitlines()[0])
        os.kill(postmaster, signal.SIGSTOP)
        while state(postmaster) not in "TZ":    # it may be beginning one more
            time.sleep(0.001)
        children = pathlib.Path(f"/proc/{postmaster}/task/{postmaster}/children").read_text().split()
        stopped = [postmaster]
        for process in map(int, children):
            if send(process, signal.SIGSTOP):
                stopped.append(process)
        return stopped

    @contextlib.contextmanager
    def frozen(self):
        """A server that does not answer, as if the network were cut."""
        processes = self.processes()
        try:
            yield
        finally:
            for process in processes:
                send(process, signal.SIGCONT)

    def kill(self):
        """Ends all processes of the server at once."""
        processes = self.processes()
        for process in processes:
            send(process, signal.SIGKILL)
        while any(state(process) != "Z" for process in processes):
            time.sleep(0.01)
        # Their zombies would be taken for a server that runs.
        for lock in (self.data / "postmaster.pid", self.folder / f".s.PGSQL.{self.port}.lock"):
            lock.unlink()

    def runs(self):
        """Whether it takes connections."""
        return subprocess.run([programs() / "pg_isready", "-q", "-h", self.folder, "-p", str(self.port)],
                              check=False).returncode == 0

    @contextlib.contextmanager
    def full(self):
        """A server whose disk, of its own, is full. It may end itself; afterwards it runs again."""
        stop = threading.Event()

        def fill():
            with (self.disk / "ballast").open("wb", buffering=0) as ballast:
                while not stop.wait(0.02):    # the server may have removed something
                    disk = os.statvfs(self.disk)
                    free = disk.f_bavail * disk.f_frsize
                    with contextlib.suppress(OSError):
                        if free:
                            os.posix_fallocate(ballast.fileno(), ballast.tell(), free)
                            ballast.seek(0, os.SEEK_END)

        filling = threading.Thread(target=fill)
        filling.start()
        try:
            yield
        finally:
            stop.set()
            filling.join()
            (self.disk / "ballast").unlink()
            while not self.runs():
                if not (self.data / "postmaster.pid").exists():
                    self.start()
                time.sleep(0.01)

    def address(self, database, user="admin", password=ENCODED_PASSWORD):
        secret = f":{password}" if password else ""
        return f"postgresql://{user}{secret}@127.0.0.1:{self.port}/{database}"

    @contextlib.contextmanager
    def forgetful(self, database, answers, **login):
        """The address of a server whose connection ends in place of the answer to a commit, so many times."""
        with socket.create_server(("127.0.0.1", 0)) as door:
            left = [answers]

            def forward(client):
                with client, socket.create_connection(("127.0.0.1", self.port)) as server:
                    forgets = False
                    while True:
                        for source in select.select([client, server], [], [])[0]:
                            data = source.recv(1 << 16)
                            if not data or (forgets and source is server):
                                return
                            if source is client and b"end_batch" in data and left[0] > 0:
                                left[0] -= 1
                                forgets = True
                            (server if source is client else client).sendall(data)

            def serve():
                with contextlib.suppress(OSError):    # the door is closed
                    while True:
                        threading.Thread(target=forward, args=(door.accept()[0],), daemon=True).start()

            threading.Thread(target=serve, daemon=True).start()
            address = self.address(database, **login)
            yield address.replace(f":{self.port}/", f":{door.getsockname()[1]}/")
            door.shutdown(socket.SHUT_RDWR)

    def sql(self, database, *statements):
        """What the statements print, without headings."""
        commands = [part for statement in statements for part in ("-c", statement)]
        return subprocess.run(["psql", "-X", "-q", "-A", "-t", "-v", "ON_ERROR_STOP=1", *commands,
                               self.address(database)], check=True, capture_output=True, text=True,
                              timeout=self.limit_s).stdout

    def latest_epoch(self, database):
        """The newest epoch of the map in a database."""
        return int(self.sql(database, "SELECT max(epoch) FROM loopbit.batch"))

    def close(self):
        with contextlib.suppress(subprocess.CalledProcessError):
            self.call("pg_ctl", "-D", self.data, "-m", "immediate", "-w", "stop")
        if self.has_own_disk:
            subprocess.run(["umount", self.disk], check=True)
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
