"""An object store on this machine, for tests and scripts: a server of moto (extra ``s3``) with one bucket."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

BUCKET = "labs"


@contextlib.contextmanager
def object_store() -> Iterator[tuple[str, dict[str, str]]]:
    """URL of an empty bucket, and the environment in which the storage engine finds it."""
    import boto3

    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    options = {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
        "AWS_ALLOW_HTTP": "true",
        "AWS_ACCESS_KEY_ID": "nobody",
        "AWS_SECRET_ACCESS_KEY": "nothing",
        "AWS_REGION": "us-east-1",
    }
    program = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        try:
            for _ in range(600):
                with contextlib.suppress(OSError):
                    socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
                    break
                time.sleep(0.1)
            keys = {"aws_access_key_id": "nobody", "aws_secret_access_key": "nothing", "region_name": "us-east-1"}
            boto3.client("s3", endpoint_url=options["AWS_ENDPOINT_URL"], **keys).create_bucket(Bucket=BUCKET)
            yield f"s3://{BUCKET}", options
        finally:
            server.terminate()
