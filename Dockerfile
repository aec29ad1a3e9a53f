# Built where the tools are, run where they are not: `docker build -t flightstack .`
FROM python:3.11-slim AS build
WORKDIR /source
COPY . .
RUN python -m venv /opt/flightstack && /opt/flightstack/bin/pip install --no-cache-dir .
# A flight compiles the flight code, which is kept beside the modules.
RUN cd /tmp && /opt/flightstack/bin/flightstack fly lissajous --size 30 --out run && rm -r run

FROM python:3.11-slim
RUN useradd --create-home flightstack
COPY --from=build /opt/flightstack /opt/flightstack
USER flightstack
WORKDIR /home/flightstack
ENV PATH=/opt/flightstack/bin:$PATH
ENTRYPOINT ["flightstack"]
CMD ["--help"]
