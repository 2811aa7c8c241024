"""Receive the live poses of a running rig in an asyncio program, concurrently with another task.

python examples/07_live_poses_async.py studio.toml tcp/127.0.0.1:7447
"""

import asyncio
import sys

import zenocap


async def watch(rig: str, connect: list[str]) -> int:
    count = 0
    with zenocap.subscribe(rig, connect=connect, timeout_s=30.0) as poses:
        async for pose in poses:
            count += 1
            turn = pose.angles["navel.y"]
            print(f"frame {pose.frame}: turned by {turn:.2f} rad{' (lost)' if pose.lost else ''}")
            if count == 20:
                break
    return count


async def main() -> None:
    other = asyncio.create_task(asyncio.sleep(0.1, "another task ran"))
    print(await watch(sys.argv[1], sys.argv[2:]), "poses;", await other)


asyncio.run(main())
