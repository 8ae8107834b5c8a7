# docker build -t fragfield . && docker run -it -v "$PWD/runs:/fragfield/runs" fragfield run cases/m107_tnt.toml
FROM debian:trixie
WORKDIR /fragfield
COPY . .
RUN sh setup.sh install && rm -rf /var/lib/apt/lists/* /root/.cache/pip
ENV PATH=/fragfield/.venv/bin:$PATH OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
ENTRYPOINT ["fragfield"]
CMD ["--help"]
