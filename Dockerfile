# volprep as a container, run by a user without rights:
#
#     docker build --tag volprep .
#     docker run --rm --volume "$PWD:/data" volprep build scene.toml -o scene.volpkg
#
# The first stage builds the wheel with everything native inside; the second has Python, the wheel, and Mesa's software
# driver for validation. Debian 12, because its driver has OpenGL ES 1.1 too.
FROM debian:12-slim AS wheel
# Stands for the time of every file in the wheel; give that of the commit: --build-arg SOURCE_DATE_EPOCH=...
ARG SOURCE_DATE_EPOCH=1700000000
RUN apt-get update && apt-get install --yes --no-install-recommends make git ca-certificates
WORKDIR /source
COPY . .
RUN make wheel

FROM debian:12-slim
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        python3 python3-venv libegl1 libgles2 libgles1 libegl-mesa0 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /source/dist/*.whl /source/constraints.txt /tmp/wheel/
RUN python3 -m venv /opt/volprep \
    && /opt/volprep/bin/pip install --no-cache-dir --constraint /tmp/wheel/constraints.txt \
        "$(ls /tmp/wheel/*.whl)[validate,batch,zarr,convex]" \
    && rm -r /tmp/wheel \
    && useradd --create-home --uid 1000 volprep
USER volprep
WORKDIR /data
ENTRYPOINT ["/opt/volprep/bin/volprep"]
CMD ["--help"]
