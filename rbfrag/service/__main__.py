"""The service as a program of its own, as `rbfrag serve` starts it: python -m rbfrag.service."""

from rbfrag.service.run import serve

if __name__ == "__main__":
    serve()
