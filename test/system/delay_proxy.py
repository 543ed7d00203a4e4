"""A TCP proxy on the loopback that passes on what the server sends later, as a relay does: each picture by a time of its own."""
import collections
import random
import select
import socket
import threading
import time


class DelayProxy:
    """Passes on from `port` to `target` (host, port). What comes after a pause is a new picture: it is delayed by 0 to most_s, evenly,
    but never overtakes the one before. One client at a time."""
    PAUSE_S = 0.012

    def __init__(self, target, most_s, seed):
        self.target, self.most_s = target, most_s
        self.random = random.Random(seed)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.over, self.ends = socket.socketpair()
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def close(self):
        self.ends.close()
        self.thread.join()
        self.over.close()
        self.listener.close()

    def _run(self):
        while self.listener in select.select([self.listener, self.over], [], [])[0]:
            client, _ = self.listener.accept()
            with client, socket.create_connection(self.target) as server:
                try:
                    self._pass_on(client, server)
                except OSError:
                    pass  # either end went away

    def _pass_on(self, client, server):
        waiting = collections.deque()  # when it is due, what
        newest_s = due_s = delay_s = 0
        while True:
            pause_s = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
            ready = select.select([client, server, self.over], [], [], pause_s)[0]
            if self.over in ready:
                return
            for end in ready:
                data = end.recv(65536)
                if not data:
                    return
                if end is client:
                    server.sendall(data)
                    continue
                now_s = time.monotonic()
                if now_s > newest_s + self.PAUSE_S:
                    delay_s = self.random.uniform(0, self.most_s)
                newest_s, due_s = now_s, max(due_s, now_s + delay_s)
                waiting.append((due_s, data))
            while waiting and waiting[0][0] <= time.monotonic():
                client.sendall(waiting.popleft()[1])
