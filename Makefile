# Names for `sh setup.sh ACT`; arguments go through ARGS, for instance `make test ARGS="-k mott"`.
.PHONY: setup demo test validate bench lint attack mutants docs

setup:
	@sh setup.sh install

demo test validate bench lint attack mutants docs:
	@sh setup.sh $@ $(ARGS)
