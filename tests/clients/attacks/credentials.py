"""Tokens as docs/decisions/062 defines them, made by PyJWT and by hand: good ones and forged ones."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import pathlib
import time
import uuid

import jwt
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

STORE = "store"
LIFE_S = 3600
Metadata = tuple[tuple[str, str], ...]


class Authority:
    """Issuer of a box: its key pair and its list of revoked tokens, as files."""

    def __init__(self, folder: pathlib.Path):
        folder.mkdir(parents=True, exist_ok=True)
        self.key = Ed25519PrivateKey.generate()
        self.public = self.key.public_key().public_bytes(
            serialization.Encoding.PEM, serialization.PublicFormat.SubjectPublicKeyInfo
        )
        self.public_file, self.revoked_file = folder / "issuer.pub.pem", folder / "revoked.txt"
        self.service_file = folder / "service.token"
        self.public_file.write_bytes(self.public)
        self.revoked_file.write_text("")
        self.service_file.write_text(self.token())

    def settings(self) -> dict[str, object]:
        """Section `[auth]` of the configuration; services in processes of their own present `token` to each other."""
        return {"keys": [str(self.public_file)], "revoked": str(self.revoked_file), "token": str(self.service_file)}

    def claims(self, **changed: object) -> dict[str, object]:
        """Claims that allow everything in the store for an hour, with changes."""
        now = int(time.time())
        audience = ["capture", "tracking", "cloth", "compositor"]
        return {"iss": "attack", "sub": "attack", "aud": audience, "iat": now, "nbf": now - 5, "exp": now + LIFE_S,
                "jti": uuid.uuid4().hex, "store": STORE, "methods": ["*"]} | changed

    def token(self, **changed: object) -> str:
        """A signed token."""
        return jwt.encode(self.claims(**changed), self.key, algorithm="EdDSA")

    def revoke(self, identity: str) -> None:
        """Adds a token's `jti` to the list."""
        with self.revoked_file.open("a") as f:
            f.write(identity + "\n")

    def forgeries(self, session: str) -> dict[str, str | None]:
        """A token of each kind that must be refused; `session` is the only one that its bearer may touch."""
        revoked = uuid.uuid4().hex
        self.revoke(revoked)
        return {
            "none": None,
            "expired": self.token(exp=int(time.time()) - 60),
            "wrong audience": self.token(aud=["elsewhere"]),
            "other session": self.token(session=session),
            "other store": self.token(store="elsewhere"),
            "revoked": self.token(jti=revoked),
            "algorithm none": by_hand("none", self.claims(), None),
            "public key as secret": by_hand("HS256", self.claims(), self.public),
        }


def by_hand(algorithm: str, claims: dict[str, object], secret: bytes | None) -> str:
    """A token that PyJWT refuses to make."""
    part = lambda data: base64.urlsafe_b64encode(data).rstrip(b"=")
    body = b".".join(part(json.dumps(d).encode()) for d in ({"alg": algorithm, "typ": "JWT"}, claims))
    signature = hmac.new(secret, body, hashlib.sha256).digest() if secret else b""
    return (body + b"." + part(signature)).decode()


def bearer(token: str | None) -> Metadata:
    """Metadata of a call."""
    return (("authorization", f"Bearer {token}"),) if token else ()
