"""The service as a separate program, as started by `rbfrag serve`: python -m rbfrag.service."""

from rbfrag.service.run import serve

if __name__ == "__main__":
    serve()
