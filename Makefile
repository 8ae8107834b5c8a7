# Names for `sh setup.sh ACT`; arguments go through ARGS, for instance `make test ARGS="-k mott"`.
.PHONY: setup demo examples test processors validate bench lint attack docs

setup:
	@sh setup.sh install

demo examples test processors validate bench lint attack docs:
	@sh setup.sh $@ $(ARGS)
