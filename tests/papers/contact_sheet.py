def write_contact_sheet(bench, folder):
    raise NotImplementedError
