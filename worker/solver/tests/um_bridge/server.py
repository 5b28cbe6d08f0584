"""A server of UM-Bridge, protocol 1.0; um_bridge.rs says what its models do."""

import json, math, os, pathlib, signal, threading, time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

SIZES = {"line": [2], "two": [1, 1], "odd": [2], "sick": [2], "die": [2], "hang": [2], "pair": [2], "doom": [2],
         "luck": [2]}

class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def say(self, answer, status=200):
        body = json.dumps(answer).encode()
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        self.say({"protocolVersion": VERSION, "models": list(SIZES)})

    def do_POST(self):
        asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        name = asked["name"]
        if self.path == "/ModelInfo":
            self.say({"support": {"Evaluate": True, "Gradient": False}})
        elif self.path == "/InputSizes":
            self.say({"inputSizes": SIZES[name]})
        elif self.path == "/OutputSizes":
            self.say({"outputSizes": [1]})
        elif name == "sick":
            self.say({"error": {"type": "InvalidInput", "message": "a is below the melting point"}}, 400)
        elif name == "odd":
            self.say({"output": [[1.0]]})
        else:
            if name == "die" and not MARK.exists():
                MARK.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            if name == "hang" and not MARK.exists():
                MARK.touch()
                threading.Event().wait()
            if name == "pair":
                beside(f"pair-{os.getpid()}").touch()
                while len(list(MARK.parent.glob("pair-*"))) < 2:
                    time.sleep(0.01)
            if name == "doom" and len(list(MARK.parent.glob("doom-*"))) < 5:
                if DOOMED.wait() == 0:
                    beside(f"doom-{os.getpid()}").touch()
                    os.kill(os.getpid(), signal.SIGKILL)
                threading.Event().wait()
            if name == "luck":
                deaths = len(list(MARK.parent.glob("luck-*")))
                beside(f"luck-{os.getpid()}").touch()
                if deaths == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
                elif deaths == 1:
                    os._exit(1)
            a, b = [math.nan if v is None else v for vector in asked["input"] for v in vector]
            self.say({"output": [[a + b * t for t in asked["config"]["times"]]]})

    def log_message(self, *_):
        pass

VERSION = float(os.environ.get("VERSION", "1.0"))
beside = pathlib.Path(__file__).absolute().with_name
MARK = beside("mark")
DOOMED = threading.Barrier(2)
server = ThreadingHTTPServer(("127.0.0.1", int(os.environ["PORT"])), Handler)
print("serving", flush=True)
server.serve_forever()
