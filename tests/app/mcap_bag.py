"""MCAP files and CDR messages of the tests' own: nothing of it is shared with the product."""

import collections
import struct

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 1, 2, 3, 4, 5, 6, 15

Message = collections.namedtuple("Message", "topic type definition log_ns publish_ns data")


def _text(value):
    data = value.encode()
    return struct.pack("<I", len(data)) + data


class _Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, pattern):
        values = struct.unpack_from("<" + pattern, self.data, self.at)
        self.at += struct.calcsize("<" + pattern)
        return values if len(values) > 1 else values[0]

    def bytes(self, size):
        self.at += size
        return self.data[self.at - size:self.at]

    def text(self):
        return self.bytes(self.take("I")).decode()


def _records(data):
    at = 0
    while at + 9 <= len(data):
        opcode, size = struct.unpack_from("<BQ", data, at)
        yield opcode, data[at + 9:at + 9 + size]
        at += 9 + size


def read_messages(path):
    """Messages of a file without compression, as they lie in it."""
    data = path.read_bytes()
    assert data.startswith(MAGIC) and data.endswith(MAGIC)
    schemas, channels, messages = {}, {}, []

    def take(opcode, body):
        r = _Reader(body)
        if opcode == CHUNK:
            _, _, _, _, compression = r.take("Q"), r.take("Q"), r.take("Q"), r.take("I"), r.text()
            assert compression == "", "a chunk is compressed"
            for inner in _records(r.bytes(r.take("Q"))):
                take(*inner)
        elif opcode == SCHEMA:
            number, name, _ = r.take("H"), r.text(), r.text()
            schemas[number] = (name, r.text())
        elif opcode == CHANNEL:
            number, schema = r.take("HH")
            channels[number] = (r.text(), *schemas[schema])
        elif opcode == MESSAGE:
            channel, _, log_ns, publish_ns = r.take("HIQQ")
            messages.append(Message(*channels[channel], log_ns, publish_ns, body[r.at:]))

    for opcode, body in _records(data[len(MAGIC):-len(MAGIC)]):
        if opcode == DATA_END:
            break
        take(opcode, body)
    return messages


def write_messages(path, messages):
    """The plainest file that there is: no chunk, no index, no statistics, no quality of service."""
    numbers = {}
    with open(path, "wb") as file:

        def put(opcode, body):
            file.write(struct.pack("<BQ", opcode, len(body)) + body)

        file.write(MAGIC)
        put(HEADER, _text("ros2") + _text("a test"))
        for m in messages:
            if m.topic not in numbers:
                number = numbers[m.topic] = len(numbers) + 1
                definition = m.definition.encode()
                put(SCHEMA, struct.pack("<H", number) + _text(m.type) + _text("ros2msg") +
                    struct.pack("<I", len(definition)) + definition)
                put(CHANNEL, struct.pack("<HH", number, number) + _text(m.topic) + _text("cdr") +
                    struct.pack("<I", 0))
            put(MESSAGE, struct.pack("<HIQQ", numbers[m.topic], 0, m.log_ns, m.publish_ns) + m.data)
        put(DATA_END, struct.pack("<I", 0))
        put(FOOTER, struct.pack("<QQI", 0, 0, 0))
        file.write(MAGIC)


class _Cdr:
    """Fields of a message in little-endian CDR, each aligned to its size."""

    def __init__(self, data):
        self.reader = _Reader(data[4:])

    def number(self, kind="I"):
        self.reader.at += -self.reader.at % struct.calcsize(kind)
        return self.reader.take(kind)

    def bytes(self):
        return self.reader.bytes(self.number())

    def text(self):
        return self.bytes()[:-1].decode()

    def stamp_ns(self):
        return self.number("i") * 10**9 + self.number()


Image = collections.namedtuple("Image", "stamp_ns frame_id height width encoding step data")


def read_image(data):
    """sensor_msgs/Image."""
    r = _Cdr(data)
    stamp_ns, frame_id, height, width = r.stamp_ns(), r.text(), r.number(), r.number()
    encoding = r.text()
    r.number("B")  # is_bigendian
    return Image(stamp_ns, frame_id, height, width, encoding, r.number(), r.bytes())


StereoFrame = collections.namedtuple("StereoFrame", "stamp_ns session sequence left right")
SideImage = collections.namedtuple("SideImage", "valid height width encoding step data")


def read_stereo_frame(data):
    """sovo_msgs/StereoFrame."""
    r = _Cdr(data)

    def side():
        valid, height, width, encoding = r.number("?"), r.number(), r.number(), r.text()
        step = r.number()
        for kind in "ffqQ":  # exposure_s, gain_db, stamp_offset_ns, dropped
            r.number(kind)
        return SideImage(valid, height, width, encoding, step, r.bytes())

    stamp_ns, _, session, sequence = r.stamp_ns(), r.text(), r.number("Q"), r.number("Q")
    for kind in "Bdd":  # clock, stamp_sigma_s, pair_error_s
        r.number(kind)
    return StereoFrame(stamp_ns, session, sequence, side(), side())


def write_image(image, order="<"):
    """CDR of an image; `order` is that of its numbers, "<" or ">"."""
    out = bytearray()

    def number(value):
        out.extend(b"\0" * (-len(out) % 4) + struct.pack(order + "I", value))

    def text(value):
        number(len(value) + 1)
        out.extend(value.encode() + b"\0")

    number(image.stamp_ns // 10**9)
    number(image.stamp_ns % 10**9)
    text(image.frame_id)
    number(image.height)
    number(image.width)
    text(image.encoding)
    out.append(0)
    number(image.step)
    number(len(image.data))
    out.extend(image.data)
    return bytes([0, 1 if order == "<" else 0, 0, 0]) + bytes(out)
