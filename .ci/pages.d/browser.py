"""A headless Chromium, spoken with by its DevTools protocol: pages, clicks, pictures, and what a page did that it should not."""

import base64
import json
import pathlib
import subprocess
import tempfile
import time

import websocket

# How often a picture is asked for, and how long one may take.
PICTURE_TRIES, PICTURE_SECONDS = 4, 20


class Browser:
    """The browser's process and the one connection to it."""

    def __init__(self):
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.process = subprocess.Popen(
            ["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-port=0",
             "--remote-allow-origins=*", f"--user-data-dir={self.profile.name}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port_file = pathlib.Path(self.profile.name) / "DevToolsActivePort"
        until(lambda: port_file.exists() and len(port_file.read_text().split()) == 2, 60, "the browser has no port")
        port, path = port_file.read_text().split()
        self.socket = websocket.create_connection(f"ws://127.0.0.1:{port}{path}", timeout=60)
        self.number, self.events = 0, []

    def send(self, method, session=None, seconds=60, **params):
        """Asks and waits for the answer; events that come meanwhile are kept, and what nobody waits for any more is not."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        self.socket.send(json.dumps(message))
        end = time.monotonic() + seconds
        while True:
            self.socket.settimeout(max(0.01, end - time.monotonic()))
            try:
                answer = json.loads(self.socket.recv())
            except websocket.WebSocketTimeoutException:
                raise TimeoutError(f"{method} has no answer after {seconds} s") from None
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            if "method" in answer:
                self.events.append(answer)

    def close(self):
        self.process.terminate()
        self.process.wait()


class Page:
    """One page of the browser."""

    def __init__(self, browser, width=1400, height=1000, dark=False):
        self.browser = browser
        self.target = browser.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.send("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.send(f"{domain}.enable")
        self.size(width, height)
        self.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def send(self, method, **params):
        return self.browser.send(method, session=self.session, **params)

    def size(self, width, height):
        self.width = width
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)

    def open(self, url):
        """Opens an address; the time until it is loaded, s."""
        # What is not in front draws no frames, and figures wait for one.
        self.send("Page.bringToFront")
        self.url, begun = url, time.monotonic()
        self.send("Page.navigate", url=url)
        self.wait("document.readyState === 'complete'", 60)
        took = time.monotonic() - begun
        self.drawn()
        return took

    def drawn(self):
        """Waits until what is there is drawn: an idle headless browser draws nothing unless it is asked to."""
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")

    def run(self, script):
        """The value of an expression."""
        answer = self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{script}: {answer['exceptionDetails'].get('exception', {}).get('description')}")
        return answer["result"].get("value")

    def wait(self, script, seconds, why=""):
        until(lambda: self.run(f"Boolean({script})"), seconds, why or script)

    def move(self, x, y):
        self.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def click(self, selector):
        """Clicks on the middle of an element as a person does."""
        x, y = self.run(f"""(() => {{ const e = document.querySelector({json.dumps(selector)}); e.scrollIntoView({{ block: "center" }});
            const r = e.getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]; }})()""")
        self.move(x, y)
        for kind in ("mousePressed", "mouseReleased"):
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def key(self, name):
        code = {"Enter": 13, "Escape": 27, "ArrowRight": 39, "ArrowLeft": 37, "Tab": 9}[name]
        for kind in ("keyDown", "keyUp"):
            text = {"text": "\r"} if name == "Enter" and kind == "keyDown" else {}
            self.send("Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=code, **text)

    def picture(self, path, whole=False):
        """Keeps what is seen, or the whole page. A picture of a page that changes while it is taken may wait for ever: it is asked for again."""
        for left in reversed(range(PICTURE_TRIES)):
            try:
                self.send("Page.bringToFront")
                data = self.capture(whole)
                break
            except TimeoutError:
                if not left:
                    raise
        pathlib.Path(path).write_bytes(base64.b64decode(data))

    def capture(self, whole):
        """The picture, in base64."""
        clip = {}
        if whole:
            size = self.send("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"captureBeyondViewport": True, "clip": {"x": 0, "y": 0, "width": self.width, "height": min(size["height"], 8000), "scale": 1}}
        return self.send("Page.captureScreenshot", seconds=PICTURE_SECONDS, format="png", **clip)["data"]

    def faults(self, own=("file:", "data:", "blob:", "about:")):
        """Errors on the console, and requests to anywhere else than the page's own address."""
        self.run("1")
        found = []
        for event in self.browser.events:
            if event.get("sessionId") != self.session:
                continue
            method, params = event["method"], event["params"]
            if method == "Runtime.exceptionThrown":
                found.append(str(params["exceptionDetails"].get("exception", params["exceptionDetails"]))[:400])
            elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
                found.append(str(params["args"])[:400])
            elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
                found.append(params["entry"]["text"])
            elif method == "Network.requestWillBeSent":
                url = params["request"]["url"]
                if not url.startswith(tuple(own)) and not url.startswith(self.url):
                    found.append(f"request to {url}")
        return found

    def close(self):
        self.browser.send("Target.closeTarget", targetId=self.target)


def until(is_so, seconds, why):
    """Waits until something is so."""
    end = time.monotonic() + seconds
    while not is_so():
        if time.monotonic() > end:
            raise TimeoutError(why)
        time.sleep(0.02)
