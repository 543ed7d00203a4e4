"""A TCP proxy on the loopback between a client and a server, that has faults on command."""
import os
import select
import socket
import struct
import threading


class FaultProxy:
    """Listens on `port`, passes on to `target` (host, port). One thread, everything in it; commands from any."""

    def __init__(self, target):
        self.target = target
        self.listener = self._listen(0)
        self.port = self.listener.getsockname()[1]
        self.pairs = {}  # socket -> the one at the other end; both ways
        self.servers = set()  # those of them that lead to the target
        self.silent = self.unplugged = self.over = False
        self.garbage = 0  # bytes still to be put into what the server sends
        self.commands, self.wake = os.pipe()
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    # Commands. What lasts ends with back_to_normal().
    def silence(self):
        self._command(b"s")

    def reset(self):
        self._command(b"r")

    def unplug(self):
        self._command(b"u")

    def send_garbage(self):
        self._command(b"g")

    def back_to_normal(self):
        self._command(b"n")

    def close(self):
        self._command(b"q")
        self.thread.join()
        for fd in (self.commands, self.wake):
            os.close(fd)

    def _command(self, letter):
        os.write(self.wake, letter)

    @staticmethod
    def _listen(port):
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", port))
        listener.listen(16)
        return listener

    def _run(self):
        while not self.over:
            sockets = [] if self.silent else list(self.pairs)
            if self.listener is not None:
                sockets.append(self.listener)
            for ready in select.select([self.commands, *sockets], [], [])[0]:
                if ready == self.commands:
                    self._obey(os.read(self.commands, 1))
                elif ready is self.listener:
                    self._accept()
                elif ready in self.pairs:
                    self._pass_on(ready)
        self._drop_all()
        if self.listener is not None:
            self.listener.close()

    def _obey(self, letter):
        if letter == b"s":
            self.silent = True
        elif letter == b"g":
            self.garbage = 300
        elif letter == b"n":
            self.silent = False
            if self.listener is None:
                self.listener = self._listen(self.port)
        else:
            self._drop_all()
            if letter == b"u" and self.listener is not None:
                self.listener.close()
                self.listener = None
            self.over = letter == b"q"

    def _accept(self):
        client = self.listener.accept()[0]
        try:
            server = socket.create_connection(self.target, timeout=10)
        except OSError:
            client.close()
            return
        for one, other in ((client, server), (server, client)):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.pairs[one] = other
        server.settimeout(None)
        self.servers.add(server)

    def _pass_on(self, source):
        try:
            data = source.recv(65536)
            if not data:
                raise ConnectionResetError
            if self.garbage and source in self.servers:
                # In the middle: whatever it was, it is not that any more.
                data = data[:len(data) // 2] + os.urandom(self.garbage) + data[len(data) // 2:]
                self.garbage = 0
            self.pairs[source].sendall(data)
        except OSError:
            self._drop(source)

    def _drop(self, one):
        other = self.pairs.pop(one)
        self.pairs.pop(other)
        self.servers -= {one, other}
        for each in (one, other):
            # A reset, not a polite end.
            each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            each.close()

    def _drop_all(self):
        while self.pairs:
            self._drop(next(iter(self.pairs)))
