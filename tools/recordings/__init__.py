"""Commands that read and write takes without the live services: track, record, export, recover, info, evaluate."""
