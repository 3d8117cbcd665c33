"""What a process has used so far, the same for every driver."""

import json
import resource


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def peak_bytes():
    """From VmHWM: ru_maxrss would count the process that started this one."""
    with open("/proc/self/status") as status:
        for line in status:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return 0


def write_report(path, before, after, extra=None):
    with open(path, "w") as out:
        json.dump({"cpu_seconds": {"load": before[1], "render": after[1] - before[1]},
                   "seconds": {"render": after[0] - before[0]},
                   "peak_memory_bytes": peak_bytes(), **(extra or {})}, out, indent=1)
