"""What reading has to say is kept and said, inside the block alone."""

import logging

from hcpg.report.notices import noticed


def test_notices_are_kept_in_order_and_said(capsys):
    log = logging.getLogger("hcpg.report.rows")
    with noticed() as notices:
        log.warning("%s: dropped %d bytes", "a", 3)
        log.info("too quiet to be one")
        log.warning("second")
    log.warning("afterwards")
    assert notices == ["a: dropped 3 bytes", "second"]
    assert capsys.readouterr().err.splitlines()[:2] == ["a: dropped 3 bytes", "second"]
