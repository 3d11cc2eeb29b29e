"""What a level's own entries make of a transfer function: changed between the entries, its jumps where they are."""

import numpy as np

from volprep_formats.package.function_table import Table

WALL, HAZE = (0.1, 0.2, 1.0, 1e9), (1.0, 0.5, 0.2, 0.02)


def table(*points):
    values, channels = np.array([value for value, _ in points]), np.array([entry for _, entry in points])
    return Table(values, channels[:, :3].copy(), channels[:, 3].copy())


def entries_of(of: Table, values):
    return np.column_stack(of.at(values))


def test_entries_that_change_nothing_leave_the_function():
    values = np.linspace(0.0, 10.0, 8)
    exact = table((0.0, WALL), (4.1, WALL), (4.1, HAZE), (10.0, HAZE))
    own = exact.with_entries(values, entries_of(exact, values))
    at = np.linspace(0.0, 10.0, 201)
    np.testing.assert_allclose(entries_of(own, at), entries_of(exact, at), rtol=1e-12)
    assert own.values.tolist().count(4.1) == 2


def test_a_jump_between_two_entries_is_no_ramp():
    values = np.linspace(0.0, 10.0, 6)
    exact = table((0.0, WALL), (5.0, WALL), (5.0, HAZE), (10.0, HAZE))
    entries = entries_of(exact, values)
    entries[:3, 3], entries[3:, 3] = 20.0, 0.03
    own = exact.with_entries(values, entries)
    colour, extinction = own.at(np.array([4.999, 5.001]))
    np.testing.assert_allclose(extinction, [20.0, 0.03])
    np.testing.assert_allclose(colour, [WALL[:3], HAZE[:3]])


def test_an_entry_at_a_jump_is_of_neither_side():
    values = np.linspace(0.0, 10.0, 11)
    exact = table((0.0, WALL), (5.0, WALL), (5.0, HAZE), (10.0, HAZE))
    own = exact.with_entries(values, entries_of(exact, values))
    np.testing.assert_array_equal(own.at(np.array([4.5, 5.5]))[1], [1e9, 0.02])


def test_changes_are_linear_between_entries_and_never_show_what_is_hidden():
    values = np.array([0.0, 4.0, 8.0])
    exact = table((0.0, (0.5, 0.5, 0.5, 0.0)), (3.0, (0.5, 0.5, 0.5, 0.0)), (8.0, (0.5, 0.5, 0.5, 1.0)))
    entries = entries_of(exact, values) + np.array([[0.0, 0, 0, 0.4], [0.2, 0, 0, 0.4], [0.9, 0, 0, -0.4]])
    own = exact.with_entries(values, entries)
    colour, extinction = own.at(np.array([1.0, 2.0, 3.0, 4.0, 6.0, 8.0]))
    np.testing.assert_allclose(extinction, [0.0, 0.0, 0.0, 0.6, 0.6, 0.6])
    np.testing.assert_allclose(colour[:, 0], [0.55, 0.6, 0.65, 0.7, 0.85, 1.0], atol=1e-12)
