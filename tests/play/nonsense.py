"""What no page sends: messages that are wrong in every way, from a seed."""

import json

MESSAGES = [
    {"type": "hello", "token": ""},
    {"type": "begin", "episode": 0, "assistant": "none", "options": {}, "assisted": True},
    {"type": "begin", "episode": 0, "assistant": "stochastic-q-bumpers", "options": {"alpha": 0.5}},
    {"type": "act", "number": 0, "action": 0, "device": "keyboard", "pressed": 2.0, "shown": 1.0},
    {"type": "hold", "sequence": 0, "action": 1, "device": "touch", "pressed": 1.0, "shown": 1.0},
    {"type": "pause"},
    {"type": "continue"},
    {"type": "speed", "share": "1/2"},
    {"type": "focus", "focused": False, "at": 5.0},
]
VALUES = [
    None, True, -1, 0, 1, 3, 2**31, 2**53 + 1, 10**400, -0.5, 1e12, 1e308, "", "none", "maximal",
    "keyboard", "x" * 5000, "\0", "\ud800", "\N{PILE OF POO}", [], [[]], {}, {"name": "undo"},
    {"alpha": {"alpha": {}}}, float("nan"), float("inf"),
]  # fmt: skip


def nonsense(chance, sent):
    """A message, text or bytes; `sent` are those before, which may come again."""
    kind = chance.randrange(9)
    message = dict(chance.choice(MESSAGES))
    text = json.dumps(message)
    if kind == 0:
        return chance.choice(sent) if sent else text
    if kind == 1:
        return text[: chance.randrange(len(text))]
    if kind == 2:
        return "".join(chance.choice('[]{}",:0\\u\n é') for _ in range(chance.randrange(200)))
    if kind == 3:
        return chance.choice(["[", '{"a":', '{"type":']) * chance.randrange(1, 2000)
    if kind == 4:
        return chance.randbytes(chance.randrange(300))
    if kind == 5:
        return " " * chance.choice([8191, 8192, 8193, 16000]) + text
    if kind == 6:
        message["episode"] = chance.randrange(5)
        message["number"] = chance.randrange(300)
        return json.dumps({f: v for f, v in message.items() if f in chance.choice(MESSAGES)})
    message[chance.choice([*message, "more", "type"])] = chance.choice(VALUES)
    if kind == 7:
        message.pop(chance.choice(list(message)))
    return json.dumps(message)


def frames(chance):
    """Bytes of frames that no browser sends, or some that are cut."""
    return chance.choice([
        chance.randbytes(chance.randrange(1, 2000)),
        b"\x81\x02{}",  # not masked
        b"\x81\x84\0\0\0\0\xff\xfe\xfd\xfc",  # no UTF-8
        b"\x83\x80\0\0\0\0",  # an opcode that is none
        b"\xf1\x80\0\0\0\0",  # bits that are none
        b"\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0",  # longer than anything
        b"\x81\xfe\xff\xff\0\0\0\0",  # longer than may be, and cut
        b"\x89\xfe\x00\x7e\0\0\0\0" + bytes(126),  # a ping that is too long
        b"\x80\x80\0\0\0\0",  # goes on with nothing
        b"\x01\x81\0\0\0\0a" * chance.randrange(1, 50),  # begins again and again
        b"\x01\x81\0\0\0\0a" + b"\x00\x81\0\0\0\0a" * 5000,  # goes on and on
        b"\x88\x82\0\0\0\0\x00\x01",  # closed with a code that is none
    ])  # fmt: skip


def requests(chance, address):
    """Bytes that are no request, or not one of a page."""
    return chance.choice([
        chance.randbytes(chance.randrange(1, 500)),
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/9.9\r\nHost: x\r\n\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 20_000,
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999\r\n\r\nslow",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + chance.randbytes(200),  # TLS
        f"GET /socket HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 12\r\n\r\n".encode(),
        f"GET /static/%00/..%2f..%2fserver.py HTTP/1.1\r\nHost: {address}\r\n\r\n".encode(),
        b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\nUpgrade: websocket\r\nConnection: upgrade\r\n\r\n",
    ])  # fmt: skip
