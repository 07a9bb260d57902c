#!/bin/sh
# Authority and certificates of one store's bus: certificates.sh DIR [DAYS]. Each service gets DIR/NAME/{ca,cert,key}.pem
# for /etc/tryon/bus; the authority's key stays in DIR/ca.key.pem and belongs on no box.
set -eu
dir=${1:?usage: certificates.sh DIR [DAYS]} days=${2:-90}
umask 077
mkdir -p "$dir"
make_key() { openssl genpkey -quiet -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1"; }
if [ ! -f "$dir/ca.key.pem" ]; then
  make_key "$dir/ca.key.pem"
  openssl req -x509 -new -key "$dir/ca.key.pem" -days 3650 -subj "/CN=tryon bus" -out "$dir/ca.pem"
fi
for name in router capture tracking compositor; do
  mkdir -p "$dir/$name"
  make_key "$dir/$name/key.pem"
  extensions="$dir/$name/extensions"
  printf 'subjectAltName=DNS:%s,DNS:localhost,IP:127.0.0.1\nextendedKeyUsage=serverAuth,clientAuth\nbasicConstraints=CA:FALSE\n' \
    "$name" > "$extensions"
  openssl req -new -key "$dir/$name/key.pem" -subj "/CN=$name" |
    openssl x509 -req -CA "$dir/ca.pem" -CAkey "$dir/ca.key.pem" -days "$days" -extfile "$extensions" \
      -out "$dir/$name/cert.pem" 2>/dev/null
  rm "$extensions"
  cp "$dir/ca.pem" "$dir/$name/ca.pem"
done
