"""Writes starlings/_solver_pb2.py and starlings/_solver_pb2.pyi from proto/proto/solver.proto.

    pip install grpcio-tools
    python3 generate.py            # writes
    python3 generate.py --check    # writes nothing; fails when the files are not what it would write

The module holds the serialized description of the file and makes the messages from it when it is imported. Code made by
protoc would refuse every runtime older than itself; this works with any protobuf since 4.22.
"""

import base64
import sys
import tempfile
import textwrap
from pathlib import Path

from google.protobuf import descriptor_pb2
from grpc_tools import protoc

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent.parent / "proto" / "proto" / "solver.proto"

MODULE = '''"""The messages of solver.proto. Written by generate.py: change the file there, not here."""

import base64

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

_DESCRIPTION = base64.b64decode(
{lines}
)

# A pool of its own: another copy of the same file in the process does no harm.
_POOL = descriptor_pool.DescriptorPool()
_POOL.Add(descriptor_pb2.FileDescriptorProto.FromString(_DESCRIPTION))


def _message(name):
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName("{package}." + name))


{messages}
'''


def described(folder: Path) -> descriptor_pb2.FileDescriptorProto:
    """What protoc makes of the file, without comments, and the .pyi beside it."""
    out = folder / "solver.pb"
    code = protoc.main(
        ["protoc", f"-I{SOURCE.parent}", f"--descriptor_set_out={out}", f"--pyi_out={folder}", SOURCE.name]
    )
    if code != 0:
        raise SystemExit(f"protoc ended with {code}")
    return descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes()).file[0]


def main() -> None:
    """Writes or compares both files."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = described(folder)
        stub = (folder / "solver_pb2.pyi").read_text()
    text = base64.b64encode(file.SerializeToString()).decode()
    lines = "\n".join(f'    "{line}"' for line in textwrap.wrap(text, 100))
    messages = "\n".join(f'{m.name} = _message("{m.name}")' for m in file.message_type)
    made = {
        "_solver_pb2.py": MODULE.format(lines=lines, package=file.package, messages=messages),
        "_solver_pb2.pyi": stub,
    }
    for name, content in made.items():
        path = HERE / "starlings" / name
        if "--check" not in sys.argv[1:]:
            path.write_text(content)
        elif path.read_text() != content:
            raise SystemExit(f"{path.name} is not what generate.py writes: run it")


if __name__ == "__main__":
    main()
