from drivers.pair_gate import PairGate

MS = 10**6


def test_new_fresh_pairs_of_one_instant_go_through():
    gate = PairGate(1 * MS, 250 * MS, heard_ns=0)
    assert gate.admits(100 * MS, -1 * MS, 350 * MS)
    assert gate.heard_ns == 350 * MS


def test_a_known_pair_and_one_from_the_future_are_not_heard():
    gate = PairGate(1 * MS, 250 * MS, heard_ns=0)
    assert gate.admits(100 * MS, 0, 110 * MS)
    assert not gate.admits(100 * MS, 0, 120 * MS)
    assert not gate.admits(131 * MS, 0, 130 * MS)
    assert gate.heard_ns == 110 * MS
    assert gate.n_stale == gate.n_unpaired == 0


def test_skewed_and_old_pairs_are_heard_and_counted():
    gate = PairGate(1 * MS, 250 * MS, heard_ns=0)
    assert not gate.admits(100 * MS, -2 * MS, 110 * MS)
    assert not gate.admits(101 * MS, 0, 352 * MS)
    assert (gate.n_unpaired, gate.n_stale, gate.heard_ns) == (2, 1, 352 * MS)
