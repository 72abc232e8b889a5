# SPDX-FileCopyrightText: 2026 The loopbit authors
# SPDX-License-Identifier: MIT
#
# The loopbit command in Debian 12, for a user without privileges:
#   docker build --tag loopbit .
#   docker run --rm --user "$(id -u)" --volume "$PWD:/data" loopbit run images
FROM debian:12-slim AS build
COPY . /source
RUN /source/scripts/packages

FROM debian:12-slim
COPY --from=build /source/build/packages/libloopbit0.1_*.deb /source/build/packages/libloopbit-map0.1_*.deb \
  /source/build/packages/libloopbit-images0.1_*.deb /source/build/packages/libloopbit-poses0.1_*.deb \
  /source/build/packages/libloopbit-graph0.1_*.deb /source/build/packages/libloopbit-data0.1_*.deb /source/build/packages/libloopbit-fleet0.1_*.deb \
  /source/build/packages/loopbit_*.deb /packages/
RUN apt-get update && apt-get install --yes --no-install-recommends /packages/*.deb && rm -rf /var/lib/apt/lists/*
RUN useradd --create-home loopbit
USER loopbit
WORKDIR /data
ENTRYPOINT ["loopbit"]
